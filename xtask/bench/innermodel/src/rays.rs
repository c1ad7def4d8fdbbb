//! Rays against a mesh.

use innermodel::{Folders, Point, Vector};
use innermodel_collision::Space;
use std::f64::consts::PI;
use std::fmt::Write;
use std::time::Instant;

/// Rings and sides of the ball: 100,352 triangles.
const RINGS: usize = 224;
const SIDES: usize = 224;
const RAYS: usize = 10_000;

/// A bumpy ball with a radius of about 1, as a Wavefront file.
pub(crate) fn ball() -> String {
    let mut text = String::new();
    for ring in 0..=RINGS {
        for side in 0..SIDES {
            let (t, p) = (
                PI * ring as f64 / RINGS as f64,
                2.0 * PI * side as f64 / SIDES as f64,
            );
            let r = 1.0 + 0.05 * (9.0 * t).sin() * (7.0 * p).cos();
            let (x, y, z) = (r * t.sin() * p.cos(), r * t.cos(), r * t.sin() * p.sin());
            writeln!(text, "v {x} {y} {z}").expect("a text");
        }
    }
    for ring in 0..RINGS {
        for side in 0..SIDES {
            let (a, b) = (
                ring * SIDES + side + 1,
                ring * SIDES + (side + 1) % SIDES + 1,
            );
            writeln!(
                text,
                "f {a} {b} {}\nf {b} {} {}",
                a + SIDES,
                b + SIDES,
                a + SIDES
            )
            .expect("a text");
        }
    }
    text
}

/// The time of all rays, in ms: from points around the ball towards its middle.
pub(crate) fn figure() -> f64 {
    let folder = std::env::temp_dir().join(format!("bench_rays_{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    std::fs::write(folder.join("ball.obj"), ball()).expect("a file");
    let text =
        r#"<innerModel><mesh id="ball" file="ball.obj" scale="1000" collide="1"/></innerModel>"#;
    let place = folder.join("world.xml");
    let (document, _) = innermodel::read_text(text, &place, &Folders::default()).expect("a text");
    let tree = innermodel::InnerModel::from_document(&document)
        .expect("a tree")
        .snapshot();
    let space = Space::new(&tree);
    let _ = std::fs::remove_dir_all(&folder);
    let mut times = Vec::new();
    for _ in 0..11 {
        let start = Instant::now();
        let mut hits = 0;
        for n in 0..RAYS {
            let (t, p) = (n as f64 * 0.618, n as f64 * 2.399);
            let from = Vector::new(t.sin() * p.cos(), t.cos(), t.sin() * p.sin()) * 3000.0;
            let to = Vector::new(p.sin(), t.sin(), 0.3) * 300.0;
            let found = space.ray("root", Point::from(from), to - from, 1e5, &|_| true);
            hits += usize::from(found.expect("a root").is_some());
        }
        assert!(hits > RAYS * 9 / 10, "{hits}");
        times.push(start.elapsed().as_secs_f64() * 1000.0);
    }
    crate::median(times)
}
