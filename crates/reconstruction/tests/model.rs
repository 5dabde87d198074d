//! Scans of one object are put into one frame, even if there is a scan of something else among them.
#![allow(clippy::unwrap_used, reason = "helpers of tests are tests")]

use congruent_geometry::random::Stream;
use congruent_geometry::{RawScan, RigidTransform, Scan, mean_displacement};
use congruent_multiway::Fate;
use congruent_pipeline::PipelineConfig;
use congruent_reconstruction::{Judged, Model, reconstruct};
use congruent_simulation::Mesh;
use congruent_simulation::nuisances::moved;
use congruent_simulation::scanner::VirtualScanner;
use congruent_simulation::shapes::{figurine, room};

/// Returns a scan from this side, moved by a motion of its own, and the motion from its coordinates back to the world.
fn look(mesh: &Mesh, azimuth_deg: f64, item: u64) -> (Scan, RigidTransform) {
    let scanner = VirtualScanner::orbit(mesh, azimuth_deg.to_radians(), 0.4, 3.0, 110);
    let mut stream = Stream::new(3, item);
    let shift = [(); 3].map(|()| stream.between(-50.0, 50.0));
    let motion = RigidTransform::from_parts(shift.into(), stream.rotation());
    let raw: RawScan = moved(&scanner.scan(mesh, item).cloud(), &motion);
    (Scan::new(&raw).unwrap(), scanner.world_from_sensor * motion.inverse())
}

fn model(scans: &[Scan], threads: usize) -> Model {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| reconstruct(scans, &PipelineConfig::default()))
}

#[test]
fn four_looks_come_into_one_frame_and_a_stranger_stays_alone() {
    let (object, stranger) = (figurine(1), room(4));
    let azimuths = [0.0, 45.0, 90.0, 135.0];
    let mut looks: Vec<(Scan, RigidTransform)> = (0..).zip(azimuths).map(|(i, a)| look(&object, a, i)).collect();
    looks.insert(2, look(&stranger, 0.0, 9));
    let (scans, world_from_scan): (Vec<Scan>, Vec<RigidTransform>) = looks.into_iter().unzip();
    let found = model(&scans, 2);
    assert_eq!(found.components, [vec![0, 1, 3, 4], vec![2]], "{:?}", found.pairs);
    for at in [1, 3, 4] {
        let truth = world_from_scan[0].inverse() * world_from_scan[at];
        let origin = RigidTransform::from(*scans[at].origin());
        let off = mean_displacement(scans[at].points(), &(found.frame_from_scan[at] * origin), &(truth * origin));
        let spacing = scans[at].extent().max() / 110.0;
        assert!(off < spacing, "scan {at} is off by {off}, its points are some {spacing} apart");
    }
    let proposed: usize = found.pairs.iter().map(|pair| pair.poses.len()).sum();
    assert_eq!(found.proposals.len(), proposed);
    let shows_the_stranger = |judged: &Judged| {
        let pair = &found.pairs[judged.proposal.pair];
        pair.source == 2 || pair.target == 2
    };
    let kept = |judged: &&Judged| judged.fate == Some(Fate::Kept);
    assert!(found.proposals.iter().filter(kept).count() >= 3);
    assert!(!found.proposals.iter().filter(kept).any(shows_the_stranger));
    let alone = model(&scans, 1);
    assert_eq!((found.frame_from_scan, found.pairs), (alone.frame_from_scan, alone.pairs));
}

#[test]
fn nothing_and_one_scan_are_fine() {
    assert!(model(&[], 1).components.is_empty());
    let (one, _) = look(&figurine(2), 0.0, 0);
    let found = model(&[one], 1);
    assert_eq!((found.components, found.frame_from_scan), (vec![vec![0]], vec![RigidTransform::identity()]));
}
