//! The costs of conversions: the printed function compared with a hand-written one, the program of
//! a connection with the printed function, and the check of a network with conversions with one
//! without.

use rc_cdsl::Component;
use rc_conversion::{Place, Plan, Program};
use rc_diagnostics::{Format, SourceMap, render};
use rc_syntax::MemoryLoader;
use std::collections::HashMap;
use std::hint::black_box;
use std::time::Instant;

include!(concat!(env!("OUT_DIR"), "/emitted.rs"));

const IDSL: &str = include_str!("../Cloud.idsl");
const PROTOTYPES: &str = include_str!("../lidar.dproto");
const POINTS: usize = 100_000;

/// Does what `scan_to_point` does, as one would write it.
fn point_by_hand(from: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = from.map(|number| number / 1000.0);
    [y, -x, z]
}

/// Does what `scan_pose_to_pose` does.
fn pose_by_hand(from: &[f64; 7]) -> Option<[f64; 7]> {
    let [px, py, pz, x, y, z, w] = *from;
    let length = (x * x + y * y + z * z + w * w).sqrt();
    if !(0.999..=1.001).contains(&length) {
        return None;
    }
    let [px, py, pz] = point_by_hand([px, py, pz]);
    let single = |number: f64| f64::from(number as f32);
    Some([single(px), single(py), single(pz), y, -x, z, w])
}

/// The smallest time of a call among some rounds, in nanoseconds. The ways take turns, so that a
/// slow moment of the machine slows all of them.
fn measure(rounds: usize, calls: usize, ways: &mut [&mut dyn FnMut()]) -> Vec<f64> {
    let mut best = vec![f64::INFINITY; ways.len()];
    for _ in 0..rounds {
        for (best, way) in best.iter_mut().zip(ways.iter_mut()) {
            let begin = Instant::now();
            for _ in 0..calls {
                way();
            }
            let each = begin.elapsed().as_secs_f64() * 1e9 / calls as f64;
            *best = best.min(each);
        }
    }
    best
}

/// A component with the prototypes of the lidar, or of the mapper.
fn component(sources: &mut SourceMap, name: &str, role: &str, is_lidar: bool) -> Component {
    let [point, pose] = if is_lidar {
        ["scan", "scan_pose"]
    } else {
        ["point", "pose"]
    };
    // The structures choose.
    let chosen = |idsl: &str, ty: &str, prototype: &str| {
        let wanted = format!("struct {ty}\n");
        idsl.replace(&wanted, &format!("@dproto(\"{prototype}\")\n    {wanted}"))
    };
    let idsl = chosen(&chosen(IDSL, "Point", point), "Pose", pose);
    let cdsl = format!(
        "import \"Cloud.idsl\";\nimport \"lidar.dproto\";\nComponent {name} {{ Communications {{ {role}; }}; language rust; }};"
    );
    let source = sources.add(format!("{name}.cdsl"), cdsl);
    let loader = MemoryLoader::new([("Cloud.idsl", idsl.as_str()), ("lidar.dproto", PROTOTYPES)]);
    let (component, mut found) = rc_cdsl::load(sources, &loader, source);
    let mut component = component.expect("a component");
    found.extend(rc_cdsl::meanings(&mut component, sources, &loader, source));
    assert!(
        !found.has_errors(),
        "{}",
        render(sources, &found, Format::Short)
    );
    component
}

/// Reads and checks a network; gives the plans of its connections.
fn checked(components: &[(String, &str, bool)], binds: &str) -> Vec<Plan> {
    let mut sources = SourceMap::new();
    let known: HashMap<&str, Component> = components
        .iter()
        .map(|(name, role, is_lidar)| {
            (
                name.as_str(),
                component(&mut sources, name, role, *is_lidar),
            )
        })
        .collect();
    let declared: String = components
        .iter()
        .map(|(name, ..)| format!("Component {name} {{ cdsl \"{name}\"; }};\n"))
        .collect();
    let text = format!("Deployment n {{\n{binds}\n{declared}}};");
    let source = sources.add("n.ddsl", text);
    let (deployment, found) = rc_ddsl::load(&mut sources, &MemoryLoader::default(), source);
    assert!(
        !found.has_errors(),
        "{}",
        render(&sources, &found, Format::Short)
    );
    let deployment = deployment.expect("a deployment");
    let parts: Vec<Option<&Component>> = deployment
        .instances
        .iter()
        .map(|instance| known.get(instance.name.text.as_str()))
        .collect();
    let (network, found) = rc_ddsl::connect(&deployment, &parts);
    assert!(
        !found.has_errors(),
        "{}",
        render(&sources, &found, Format::Short)
    );
    network
        .conversions
        .into_values()
        .map(|made| made.plan)
        .collect()
}

/// The program of a mapper for samples of a lidar.
fn program(interface: &str) -> Program {
    let (takes, gives) = (
        format!("subscribesTo {interface}"),
        format!("publishes {interface}"),
    );
    let ends = [
        ("a".to_owned(), takes.as_str(), false),
        ("b".to_owned(), gives.as_str(), true),
    ];
    let binds = format!("bind a.{interface} -> b.{interface} {{ convert; }};");
    let plans = checked(&ends, &binds);
    plans[0].program(0, Place::Input).expect("a program")
}

fn row(what: &str, goal: f64, ours: f64, theirs: f64) {
    let ratio = ours / theirs;
    let met = if ratio <= goal { "met" } else { "**missed**" };
    println!(
        "| {what} | ≤ {goal} | {ratio:.2}: {} and {} | {met} |",
        time(ours),
        time(theirs)
    );
}

fn time(nanoseconds: f64) -> String {
    match nanoseconds {
        ..1e4 => format!("{nanoseconds:.1} ns"),
        ..1e7 => format!("{:.1} µs", nanoseconds / 1e3),
        _ => format!("{:.1} ms", nanoseconds / 1e6),
    }
}

fn points() {
    let numbers: Vec<[f32; 3]> = (0..POINTS)
        .map(|at| [at as f32, 2.0 * at as f32, 700.0])
        .collect();
    let (mut emitted, mut hand) = (numbers.clone(), numbers.clone());
    let mut bytes = u32::try_from(POINTS).expect("few").to_le_bytes().to_vec();
    bytes.extend(
        numbers
            .iter()
            .flatten()
            .flat_map(|number| number.to_le_bytes()),
    );
    let program = program("Scans");
    // Each way gives the same points.
    let check = bytes.clone();
    program.run(&mut bytes, 0).expect("in range");
    for (place, number) in numbers.iter().enumerate() {
        let wanted = point_by_hand(number.map(f64::from)).map(|number| number as f32);
        let at = 4 + 12 * place;
        let own: Vec<u8> = wanted
            .iter()
            .flat_map(|number| number.to_le_bytes())
            .collect();
        assert_eq!(bytes[at..at + 12], own);
    }
    let times = measure(
        60,
        1,
        &mut [
            &mut || {
                emitted.copy_from_slice(&numbers);
                for point in black_box(&mut emitted) {
                    if let Some(found) = scan_to_point(&point.map(f64::from)) {
                        *point = found.map(|number| number as f32);
                    }
                }
            },
            &mut || {
                hand.copy_from_slice(&numbers);
                for point in black_box(&mut hand) {
                    *point = point_by_hand(point.map(f64::from)).map(|number| number as f32);
                }
            },
            &mut || {
                bytes.copy_from_slice(&check);
                assert!(program.run(black_box(&mut bytes), 0).is_ok());
            },
        ],
    );
    row(
        "printed function / by hand, 100,000 points",
        1.10,
        times[0],
        times[1],
    );
    row(
        "program of a connection / printed function, 100,000 points",
        1.25,
        times[2],
        times[0],
    );
}

fn pose() {
    let numbers = [1000.0, 2000.0, 500.0, 0.6, 0.0, 0.0, 0.8_f32];
    let message: Vec<u8> = numbers
        .iter()
        .flat_map(|number| number.to_le_bytes())
        .collect();
    let mut bytes = message.clone();
    let program = program("Poses");
    program.run(&mut bytes, 0).expect("in range");
    let wanted = pose_by_hand(&numbers.map(f64::from)).expect("a rotation");
    let own: Vec<u8> = wanted
        .iter()
        .flat_map(|number| (*number as f32).to_le_bytes())
        .collect();
    assert_eq!(bytes, own);
    let (mut emitted, mut hand) = (numbers, numbers);
    // Each way begins with a message, and ends with one, as for points.
    let times = measure(
        60,
        20_000,
        &mut [
            &mut || {
                emitted.copy_from_slice(black_box(&numbers));
                let pose = black_box(&mut emitted);
                let found = scan_pose_to_pose(&pose.map(f64::from)).expect("a rotation");
                *pose = found.map(|number| number as f32);
            },
            &mut || {
                hand.copy_from_slice(black_box(&numbers));
                let pose = black_box(&mut hand);
                let found = pose_by_hand(&pose.map(f64::from)).expect("a rotation");
                *pose = found.map(|number| number as f32);
            },
            &mut || {
                bytes.copy_from_slice(black_box(&message));
                assert!(program.run(black_box(&mut bytes), 0).is_ok());
            },
        ],
    );
    row(
        "printed function / by hand, one pose",
        1.10,
        times[0],
        times[1],
    );
    row(
        "program of a connection / printed function, one pose",
        3.0,
        times[2],
        times[0],
    );
}

/// 100 components with 300 connections.
fn check() {
    let network = |are_lidars: bool| -> Vec<(String, &'static str, bool)> {
        let lidars = (0..10).map(|at| (format!("lidar{at}"), "publishes Scans", true));
        let mappers = (0..90).map(|at| (format!("mapper{at}"), "subscribesTo Scans", are_lidars));
        lidars.chain(mappers).collect()
    };
    let binds = |block: &str| -> String {
        (0..300)
            .map(|at| {
                let (mapper, lidar) = (at % 90, (at / 90 + at) % 10);
                format!("bind mapper{mapper}.Scans -> lidar{lidar}.Scans{block};\n")
            })
            .collect()
    };
    let (converting, plain) = (network(false), network(true));
    let (with, without) = (binds(" { convert; }"), binds(""));
    assert_eq!(
        checked(&converting, &with)
            .iter()
            .filter(|plan| !plan.is_empty())
            .count(),
        300
    );
    let times = measure(
        5,
        1,
        &mut [
            &mut || {
                black_box(checked(&converting, &with));
            },
            &mut || {
                black_box(checked(&plain, &without));
            },
        ],
    );
    row(
        "reading and checking 100 components with 300 conversions / without",
        1.3,
        times[0],
        times[1],
    );
}

fn main() {
    println!("| ratio | goal | measured | |\n|---|---|---|---|");
    pose();
    points();
    check();
}
