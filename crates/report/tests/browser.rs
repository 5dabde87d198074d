//! Pages in a real browser: they draw, report no problem and request nothing. The test says that it is skipped if there
//! is no Chromium.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "helpers of tests are tests")]

use congruent_geometry::RigidTransform;
use congruent_report::{Block, Errors, Layer, Lines, Page, Points, SOURCE, Scene, State, TARGET};
use nalgebra::{Point3, Vector3};
use std::process::{Command, Stdio};
use tempfile::TempDir;

const BROWSERS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// The result of opening a page: the document after its scripts ran, and everything that was logged.
struct Opened {
    document: String,
    log: String,
}

/// Opens a page without a network; `None` if there is no browser.
fn opened(page: &Page) -> Option<Opened> {
    let runs = |name: &&&str| {
        Command::new(name)
            .arg("--version")
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .status()
            .is_ok_and(|s| s.success())
    };
    let Some(browser) = BROWSERS.iter().find(runs) else {
        eprintln!("skipped: there is no Chromium");
        return None;
    };
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("page.html");
    std::fs::write(&file, page.html()).unwrap();
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
        .args(["--disable-background-networking", "--no-first-run", "--proxy-server=127.0.0.1:9"])
        .args(["--enable-logging=stderr", "--v=0", "--window-size=900,900", "--virtual-time-budget=2000", "--dump-dom"])
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .arg(format!("file://{}", file.display()))
        .output()
        .unwrap();
    let text = |bytes| String::from_utf8_lossy(bytes).into_owned();
    Some(Opened { document: text(&output.stdout), log: text(&output.stderr) })
}

impl Opened {
    /// Returns a number that a view reports about itself.
    fn number(&self, attribute: &str) -> Option<u64> {
        let (_, rest) = self.document.split_once(&format!(" data-{attribute}=\""))?;
        rest.split('"').next()?.parse().ok()
    }

    fn assert_quiet(&self) {
        // Software GL comments on its own slowness.
        let is_complaint =
            |line: &&str| line.contains("CONSOLE") && !line.contains("GL Driver Message (OpenGL, Performance");
        let complaints: Vec<&str> = self.log.lines().filter(is_complaint).collect();
        assert!(complaints.is_empty(), "{complaints:?}");
        assert!(self.document.contains("data-errors=\"0\""), "{}", self.log);
        assert!(!self.document.contains("data-problem"), "{}", self.log);
    }
}

fn cloud(n: usize, far: f64) -> Vec<Point3<f64>> {
    let turn = |i: usize| i as f64 * 2.399_963;
    (0..n).map(|i| Point3::new(far + turn(i).cos(), far + turn(i).sin(), 0.01 * i as f64)).collect()
}

fn points(name: &str, body: usize, points: Vec<Point3<f64>>) -> Layer {
    let colour = if body == 0 { SOURCE } else { TARGET };
    Layer::Points(Points { name: name.to_owned(), body, points, colour: colour.to_owned(), errors: vec![] })
}

fn page(scene: Scene) -> Page {
    Page {
        title: "a page".to_owned(),
        blocks: vec![Block::Views(vec![("a view".to_owned(), scene)])],
        ..Page::default()
    }
}

fn two_scans(n: usize, far: f64) -> Scene {
    let segments = vec![[Point3::new(far, far, 0.0), Point3::new(far, far, 1.0)]];
    let lines = Lines { name: "pairs".to_owned(), bodies: [0, 1], segments, colour: SOURCE.to_owned(), shown: true };
    let state = |name: &str, x| State {
        name: name.to_owned(),
        frame_from_body: vec![RigidTransform::new(Vector3::new(x, 0.0, 0.0), Vector3::zeros())],
    };
    Scene {
        states: vec![state("as scanned", 3.0), state("aligned", 0.1)],
        layers: vec![points("source", 0, cloud(n, far)), points("target", 1, cloud(n, far)), Layer::Lines(lines)],
        ..Scene::default()
    }
}

#[test]
fn clouds_of_any_size_and_place_are_drawn_without_a_word_to_console_or_network() {
    for (n, far) in [(3, 0.0), (3000, 0.0), (3000, 5e6), (70_000, -1e3)] {
        let Some(opened) = opened(&page(two_scans(n, far))) else { return };
        opened.assert_quiet();
        assert_eq!(opened.number("drawn"), Some(2 * n.min(60_000) as u64 + 2), "{n} {far}");
        assert!(opened.number("inked").is_some_and(|inked| inked > 10), "{n} {far}");
    }
}

#[test]
fn coordinates_of_a_map_are_drawn_like_those_about_the_origin() {
    let inked = |far| opened(&page(two_scans(3000, far))).map(|opened| opened.number("inked").unwrap());
    let (Some(near), Some(far)) = (inked(0.0), inked(5e6)) else { return };
    assert!(near.abs_diff(far) < near / 50, "{near} {far}");
}

#[test]
fn nothing_to_draw_is_no_error() {
    let stray = vec![Point3::new(f64::NAN, 0.0, 0.0), Point3::new(f64::INFINITY, 1.0, 0.0)];
    for scene in [Scene::default(), Scene { layers: vec![points("stray", 0, stray)], ..Scene::default() }] {
        let Some(opened) = opened(&page(scene)) else { return };
        opened.assert_quiet();
        assert_eq!(opened.number("drawn"), Some(0));
    }
}

#[test]
fn names_cannot_become_markup_or_scripts() {
    let name = "</script><script>window.onerror()</script>'\"&<b>.ply";
    let mut scene = two_scans(30, 0.0);
    scene.layers.push(points(name, 1, cloud(30, 0.0)));
    scene.states[0].name = name.to_owned();
    scene.unit = name.to_owned();
    let legend = |text: &str| text.to_owned();
    scene.errors = Some(Errors { name: legend(name), unit: legend(name), saturation: 1.0, grey: legend(name) });
    let mut page = page(scene);
    page.title = name.to_owned();
    page.blocks.push(Block::Printed(name.to_owned()));
    page.blocks.push(Block::Facts(vec![(name.to_owned(), name.to_owned())]));
    let html = page.html();
    assert_eq!(html.matches("<script").count(), 2, "the scene and the viewer");
    assert!(!html.contains("<b>"));
    let Some(opened) = opened(&page) else { return };
    opened.assert_quiet();
    assert!(opened.number("inked").is_some_and(|inked| inked > 10));
}

#[test]
fn views_side_by_side_are_all_drawn() {
    let view = |name: &str| (name.to_owned(), two_scans(500, 0.0));
    let blocks = vec![Block::Views(vec![view("one"), view("two"), view("three")])];
    let Some(opened) = opened(&Page { title: "three".to_owned(), blocks, ..Page::default() }) else { return };
    opened.assert_quiet();
    assert_eq!(opened.document.matches(" data-drawn=\"1002\"").count(), 3);
}
