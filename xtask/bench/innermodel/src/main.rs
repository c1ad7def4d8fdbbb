//! Transforms over chains of joints, loading, new versions and rays: `innermodel` compared with `k`
//! with `urdf-rs`. Both do the same chain, in turns, in one run. With a folder as argument it
//! writes the same chains and the same mesh there, for the programs in Python.

mod chains;
mod rays;

use chains::Chain;
use innermodel::{Folders, InnerModel, Point, Time};
use k::nalgebra as theirs;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

/// Transforms of a block, and the blocks of each row, measured in turns.
const TRANSFORMS: u32 = 20_000;
const BLOCKS: usize = 41;

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// The time of one run of `work`, in ns, for `count` runs.
fn time(count: u32, mut work: impl FnMut(u32)) -> f64 {
    let start = Instant::now();
    for number in 0..count {
        work(number);
    }
    start.elapsed().as_nanos() as f64 / f64::from(count)
}

/// All joints of a chain move, then the tip is asked for: in each turn, no result is known before.
fn moving(links: usize) -> (f64, f64) {
    let chain = Chain::new(links);
    let tree = chain.tree();
    let names: Vec<String> = (0..links).map(|n| format!("j{n}")).collect();
    let ids: Vec<_> = {
        let now = tree.snapshot();
        names
            .iter()
            .map(|name| now.node(name).expect("a joint").node_id())
            .collect()
    };
    let tip = tree.snapshot().node("tip").expect("a tip").node_id();
    let robot: k::Chain<f64> = (&chain.urdf()).into();
    let end = robot.find_link("tip").expect("a tip").clone();
    let point = Point::new(0.1, 0.2, 0.3);
    let there = theirs::Point3::new(0.1, 0.2, 0.3);
    let mut check = (0.0, 0.0);
    let (mut a, mut b) = (Vec::new(), Vec::new());
    for _ in 0..BLOCKS {
        a.push(time(TRANSFORMS, |n| {
            let angle = f64::from(n % 100) * 0.01;
            let moved = tree.change(Time::ZERO, |edit| {
                for id in &ids {
                    edit.set_joint(*id, angle)?;
                }
                Ok::<_, innermodel::Error>(())
            });
            moved.expect("joints");
            let now = tree.snapshot();
            let found = now
                .transform(innermodel::NodeId::ROOT, point, tip)
                .expect("a point");
            check.0 += black_box(found).coords.norm();
        }));
        b.push(time(TRANSFORMS, |n| {
            let angles = vec![f64::from(n % 100) * 0.01; links];
            robot.set_joint_positions_unchecked(&angles);
            robot.update_transforms();
            let place = end.world_transform().expect("a transform");
            check.1 += black_box(place * there).coords.norm();
        }));
    }
    (median(a), median(b))
}

/// The tip is asked for again and again, while nothing moves.
fn standing(links: usize) -> (f64, f64) {
    let chain = Chain::new(links);
    let tree = chain.tree().snapshot();
    let tip = tree.node("tip").expect("a tip").node_id();
    let robot: k::Chain<f64> = (&chain.urdf()).into();
    robot.update_transforms();
    let end = robot.find_link("tip").expect("a tip").clone();
    let point = Point::new(0.1, 0.2, 0.3);
    let there = theirs::Point3::new(0.1, 0.2, 0.3);
    let (mut a, mut b) = (Vec::new(), Vec::new());
    for _ in 0..BLOCKS {
        a.push(time(TRANSFORMS, |_| {
            let found = tree.transform(innermodel::NodeId::ROOT, black_box(point), tip);
            black_box(found.expect("a point"));
        }));
        b.push(time(TRANSFORMS, |_| {
            let place = end.world_transform().expect("a transform");
            black_box(place * black_box(there));
        }));
    }
    (median(a), median(b))
}

fn row(what: &str, goal: &str, (ours, others): (f64, f64), met: bool) -> bool {
    let mark = if met { "met" } else { "**missed**" };
    println!(
        "| {what} | {goal} | {ours:.0} | {others:.0} | {:.2} | {mark} |",
        ours / others
    );
    met
}

fn main() {
    if let Some(folder) = std::env::args().nth(1) {
        return chains::write(Path::new(&folder));
    }
    println!("| ns | goal | innermodel | k, urdf-rs | ratio | |\n|---|---|---|---|---|---|");
    let mut met = true;
    for links in [7, 30] {
        let moved = moving(links);
        let what = format!("all {links} joints move, and a point of the tip");
        met &= row(&what, "≤ 1.0 of k", moved, moved.0 <= moved.1);
        let stood = standing(links);
        let what = format!("a point of the tip of {links} links that stand");
        met &= row(&what, "≤ 1.0 of k", stood, stood.0 <= stood.1);
    }
    let (load, theirs) = chains::load();
    met &= row("load of 300 nodes", "< 5 ms", (load, theirs), load < 5e6);
    println!("\n| | goal | measured | |\n|---|---|---|---|");
    for (what, stride) in [("one joint", 0), ("a joint in another page", 64)] {
        for nodes in [10, 100, 1000, 10_000] {
            let change = version(nodes, stride);
            let good = change < 2000.0;
            let mark = if good { "met" } else { "**missed**" };
            println!(
                "| a new version of {nodes} nodes: {what} moves | < 2 µs | {:.2} µs | {mark} |",
                change / 1000.0
            );
            met &= good;
        }
    }
    let rays = rays::figure();
    println!("| 10,000 rays against 100,000 triangles | beside trimesh | {rays:.1} ms | |");
    if !met {
        eprintln!("bench_innermodel: a goal was missed");
        std::process::exit(3);
    }
}

/// The time of a change of one joint and of its publication, in ns. The next change moves the joint
/// that is `stride` nodes further.
fn version(nodes: usize, stride: usize) -> f64 {
    let tree = Chain::flat(nodes);
    let now = tree.snapshot();
    let joints: Vec<_> = (0..nodes)
        .map(|n| now.node(&format!("j{n}")).expect("a joint").node_id())
        .collect();
    let times = (0..BLOCKS).map(|_| {
        time(TRANSFORMS, |n| {
            let angle = f64::from(n % 100) * 0.01;
            let joint = joints[n as usize * stride % nodes];
            tree.change(Time::ZERO, |edit| edit.set_joint(joint, angle))
                .expect("a joint");
        })
    });
    median(times.collect())
}

/// Reads a file as a component does.
pub(crate) fn read(path: &Path) -> InnerModel {
    InnerModel::load(path, &Folders::default()).expect("a file")
}
