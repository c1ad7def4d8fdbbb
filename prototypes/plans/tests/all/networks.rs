//! Random networks of prototypes beside networkx.

use crate::{library, python};
use rc_plans::Network;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::process::Command;

const UNITS: [&str; 4] = ["", "mm", "m", "s"];
const PROTOTYPES: usize = 500;

/// A prototype of a domain of its own.
struct Made {
    name: String,
    meaning: usize,
    coordinate: usize,
    algebraic: usize,
    unit: usize,
}

/// A network: its text, the prototypes of its own domain, and the steps that must be in it.
struct Random {
    text: String,
    made: Vec<Made>,
    steps: BTreeSet<(String, String)>,
}

fn random(seed: u64) -> Random {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut text = String::from(
        "domain soil :: { semantic = { M0, M1, M2 } coord = { c0, c1, c2 } }
algebraic named :: Scalar{x, y, z}
algebraic placed :: Vector{3}
algebraic four :: Vector{4}
axes ros :: ahead, left, up
axes robocomp :: right, ahead, up
axes innermodel :: right, up, ahead
units metres :: qudt, placed { 0 = m, 1 = m, 2 = m }
units millimetres :: qudt, placed { 0 = mm, 1 = mm, 2 = mm }
",
    );
    let mut aliases = BTreeSet::new();
    for at in 0..8 {
        writeln!(text, "algebraic a{at} :: Scalar{{s{at}}}").expect("a text");
        for (unit, name) in UNITS.iter().enumerate().skip(1) {
            writeln!(
                text,
                "units u{at}_{unit} :: qudt, a{at} {{ s{at} = {name} }}"
            )
            .expect("a text");
        }
    }
    for _ in 0..7 {
        let (one, other) = (random.usize(0..8), random.usize(0..8));
        if one != other && !aliases.contains(&(other, one)) && aliases.insert((one, other)) {
            writeln!(text, "alias a{one} <-> a{other} {{ s{one} = s{other} }}").expect("a text");
        }
    }
    let mut made = Vec::new();
    let mut lines = Vec::new();
    for at in 0..PROTOTYPES {
        let name = format!("p{}_{at}", random.u8(..));
        let number = ["double", "float", "int16_t"][random.usize(0..3)];
        if at % 5 < 3 {
            let one = Made {
                name: name.clone(),
                meaning: random.usize(0..3),
                coordinate: random.usize(0..3),
                algebraic: random.usize(0..8),
                unit: random.usize(0..4),
            };
            let (algebraic, unit) = (one.algebraic, one.unit);
            let units = match unit {
                0 => String::new(),
                unit => format!("units = u{algebraic}_{unit}"),
            };
            lines.push(format!(
                "dproto {name} :: soil {{ semantic = M{} coord = c{} algebraic = a{algebraic} \
                 ddr = :: c99{{{number}}} dr = {{ 0 = s{algebraic} }} {units} }}",
                one.meaning, one.coordinate
            ));
            made.push(one);
            continue;
        }
        // Plans do not lead over prototypes without axes, which networkx does not know.
        let axes = ["axes = ros", "axes = robocomp", "axes = innermodel"][random.usize(0..3)];
        let frames = [
            "",
            "frames = { with_respect_to = map }",
            "frames = { with_respect_to = odom }",
            "frames = { with_respect_to = member frame }",
        ][random.usize(0..4)];
        let turns = ["rpy", "euler_zyz_moving", "rotation_vector", "quaternion"];
        let (semantic, coordinate, algebraic, count) = match random.usize(0..4) {
            0 => ("Position", "cartesian", "named", 3),
            1 => (
                "Position",
                ["cartesian", "spherical"][random.usize(0..2)],
                "placed",
                3,
            ),
            2 => ("LinearVelocity", "cartesian", "placed", 3),
            _ => match turns[random.usize(0..4)] {
                quaternion @ "quaternion" => ("Orientation", quaternion, "four", 4),
                other => ("Orientation", other, "placed", 3),
            },
        };
        let units = match (coordinate, semantic, algebraic) {
            ("cartesian", "Position", "placed") => {
                ["", "units = metres", "units = millimetres"][random.usize(0..3)]
            }
            _ => "",
        };
        let names = if algebraic == "named" {
            vec!["0 = x", "1 = y", "2 = z"]
        } else {
            vec!["0 = 0", "1 = 1", "2 = 2", "3 = 3"][..count].to_vec()
        };
        lines.push(format!(
            "dproto {name} :: geometry {{ semantic = {semantic} coord = {coordinate} algebraic = {algebraic} \
             ddr = :: c99{{{number}[{count}]}} dr = {{ {} }} {axes} {frames} {units} }}",
            names.join(", ")
        ));
    }
    // Some functions lead between coordinates.
    let mut functions = BTreeSet::new();
    for at in 0..40 {
        let (one, other) = (
            &made[random.usize(0..made.len())],
            &made[random.usize(0..made.len())],
        );
        if one.meaning == other.meaning && one.name != other.name {
            lines.push(format!("conversion {} -> {} = f{at}", one.name, other.name));
            functions.insert((one.name.clone(), other.name.clone()));
        }
    }
    random.shuffle(&mut lines);
    text.push_str(&lines.join("\n"));
    // The rules of domains without rules of their own, once more.
    let converts = |one: &Made, other: &Made| {
        let named = one.algebraic == other.algebraic
            || aliases.contains(&(one.algebraic, other.algebraic))
            || aliases.contains(&(other.algebraic, one.algebraic));
        let lengths = [one.unit, other.unit]
            .iter()
            .all(|unit| [1, 2].contains(unit));
        one.coordinate == other.coordinate && named && (one.unit == other.unit || lengths)
    };
    let mut steps = functions;
    for one in &made {
        for other in &made {
            if one.meaning == other.meaning && one.name != other.name && converts(one, other) {
                steps.insert((one.name.clone(), other.name.clone()));
            }
        }
    }
    Random { text, made, steps }
}

/// The steps between prototypes of a domain are those of its rules, and a plan exists and costs what
/// networkx finds.
#[test]
fn plans_cost_what_networkx_finds() {
    let python = python("plans_cost_what_networkx_finds");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/networks.py");
    for seed in 0..2 {
        let random = random(seed);
        let library = library(&random.text);
        let network = Network::new(&library);
        let edges: Vec<_> = network.edges().collect();
        let own: BTreeSet<&str> = random.made.iter().map(|made| made.name.as_str()).collect();
        let found: BTreeSet<(String, String)> = edges
            .iter()
            .filter(|(from, ..)| own.contains(from))
            .map(|(from, to, _)| ((*from).to_owned(), (*to).to_owned()))
            .collect();
        assert_eq!(found, random.steps, "seed {seed}");

        let Some(python) = python else { continue };
        let mut lines = String::new();
        for (from, to, cost) in &edges {
            writeln!(lines, "edge,{from},{to},{cost}").expect("a text");
        }
        let names: Vec<&str> = library.prototypes.iter().map(|p| p.name.as_str()).collect();
        let mut choice = fastrand::Rng::with_seed(seed + 100);
        let (mut feasible, mut longer, mut checked) = (0, 0, 0);
        while checked < 600 {
            let (one, other) = (choice.usize(0..names.len()), choice.usize(0..names.len()));
            let (one, other) = (&library.prototypes[one], &library.prototypes[other]);
            // Frames and meanings are no matter of the way.
            if one.semantic != other.semantic || one.frames != other.frames {
                continue;
            }
            checked += 1;
            let plan = network.plan(&one.name, &other.name);
            let cost = plan
                .as_ref()
                .map_or("none".to_owned(), |plan| plan.cost.total().to_string());
            feasible += usize::from(plan.is_ok());
            longer += usize::from(plan.is_ok_and(|plan| plan.distance() > 1));
            writeln!(lines, "plan,{},{},{cost}", one.name, other.name).expect("a text");
        }
        assert!(feasible > 80 && longer > 10, "{feasible} {longer}");
        let folder = tempfile::tempdir().expect("a folder");
        let list = folder.path().join("network.csv");
        std::fs::write(&list, lines).expect("a file");
        let output = Command::new(python)
            .arg(script)
            .arg(&list)
            .output()
            .expect("python");
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{errors}");
        assert_eq!(
            String::from_utf8_lossy(&output.stdout).trim(),
            checked.to_string()
        );
    }
}

/// The order of a file changes no plan.
#[test]
fn plans_do_not_depend_on_the_order_of_files() {
    let random = random(7);
    let one = library(&random.text);
    let reversed: Vec<&str> = random.text.lines().rev().collect();
    let other = library(&reversed.join("\n"));
    let (one_network, other_network) = (Network::new(&one), Network::new(&other));
    let mut longer = 0;
    for from in one.prototypes.iter().step_by(9) {
        for to in one.prototypes.iter().step_by(4) {
            let plan = one_network.plan(&from.name, &to.name);
            assert_eq!(plan, other_network.plan(&from.name, &to.name));
            longer += usize::from(plan.is_ok_and(|plan| plan.distance() > 1));
        }
    }
    assert!(longer > 20, "{longer}");
}
