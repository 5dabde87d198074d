//! A furnished room, seen from within.

use super::cuboid;
use crate::Mesh;
use congruent_geometry::random::Stream;
use nalgebra::{Rotation2, Vector2, Vector3};

/// Length, width and height of the room, say in metres.
pub const ROOM_SIZE: [f64; 3] = [6.0, 4.5, 2.6];
/// Number of pieces of furniture.
const N_BOXES: usize = 9;
/// Distance of furniture from the room's middle, so that a scanner fits there.
const CLEARANCE: f64 = 0.8;

/// Returns an empty box with the floor at z = 0 and its middle on the z axis, walls facing inwards, with boxes of
/// random sizes on the floor, rotated about the vertical. Boxes may overlap; none comes nearer to the z axis than 0.8
/// units.
#[must_use]
pub fn room(seed: u64) -> Mesh {
    let mut stream = Stream::new(seed, 0);
    let mut mesh = cuboid(ROOM_SIZE).inside_out();
    mesh.points.iter_mut().for_each(|p| p[2] += ROOM_SIZE[2] / 2.0);
    for _ in 0..N_BOXES {
        mesh.append(&furniture(&mut stream));
    }
    mesh
}

/// Returns a box that stands on the floor inside the walls.
fn furniture(stream: &mut Stream) -> Mesh {
    let size = [stream.between(0.3, 1.2), stream.between(0.3, 0.8), stream.between(0.3, 1.9)];
    // Its diagonal keeps the box off the walls and off the middle, however it is rotated.
    let reach = Vector2::new(size[0], size[1]).norm() / 2.0;
    let half = Vector2::new(ROOM_SIZE[0], ROOM_SIZE[1]) / 2.0 - Vector2::repeat(reach);
    let mut place = || Vector2::new(stream.between(-half.x, half.x), stream.between(-half.y, half.y));
    let mut at = place();
    while at.norm() < CLEARANCE + reach {
        at = place();
    }
    let turn = Rotation2::new(stream.between(0.0, std::f64::consts::PI));
    let mut mesh = cuboid(size);
    mesh.points.iter_mut().for_each(|p| {
        let flat = turn * Vector2::new(p[0], p[1]) + at;
        *p = Vector3::new(flat.x, flat.y, p[2] + size[2] / 2.0).into();
    });
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn furniture_stands_inside_the_walls_and_off_the_middle() {
        for seed in 0..20 {
            let mesh = room(seed);
            assert_eq!(mesh.points.len(), 8 * (1 + N_BOXES));
            for p in &mesh.points[8..] {
                let inside = p[0].abs() <= ROOM_SIZE[0] / 2.0 && p[1].abs() <= ROOM_SIZE[1] / 2.0;
                assert!(inside && (-1e-12..=ROOM_SIZE[2]).contains(&p[2]), "{p:?}");
                assert!(p[0].hypot(p[1]) >= CLEARANCE);
            }
        }
        assert_ne!(room(1), room(2));
    }
}
