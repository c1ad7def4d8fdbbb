//! Robots of URDF files as graphs: the query of D's figure 3.11, and masses and poses by traversal
//! beside Pinocchio.

use graph_exchange::robot;
use graph_query::{Budget, Cell, Mark, Queries, traverse};
use property_graph::{EdgeId, Error, Graph, NodeId, Snapshot, Time, Value};
use rc_diagnostics::{Format, SourceMap, render};
use rc_quantity::rotation::{EulerOrder, from_rotation_vector};
use rc_robot::{Joint, Motion, Robot};
use std::fmt::Write as _;
use std::io::Write as _;
use std::process::{Command, Stdio};

/// An arm with the lengths of a UR5.
const SIX: &str = include_str!("../../../../kinematics/examples/six.urdf");
/// An arm with the lengths of a Franka.
const SEVEN: &str = include_str!("../../../../kinematics/tests/robots/seven.urdf");

/// A humanoid of thirty joints: two legs of six, two arms of seven, a waist of two, and a head of two.
fn humanoid() -> String {
    let mut out = String::from("<robot name=\"humanoid\">\n");
    let link = |name: &str, mass: f64, centre: [f64; 3]| {
        let [x, y, z] = centre;
        format!(
            "<link name=\"{name}\"><inertial><origin xyz=\"{x} {y} {z}\" rpy=\"0.1 0.2 0.3\"/><mass value=\"{mass}\"/>\
            <inertia ixx=\"0.05\" iyy=\"0.04\" izz=\"0.03\" ixy=\"0.002\" ixz=\"0.001\" iyz=\"-0.003\"/></inertial></link>\n"
        )
    };
    out += &link("pelvis", 11.5, [0.0, 0.0, 0.07]);
    let mut limb = |base: &str, name: &str, start: [f64; 3], axes: &[&str], length: f64| {
        let mut parent = base.to_owned();
        for (at, axis) in axes.iter().enumerate() {
            let [x, y, z] = if at == 0 {
                start
            } else {
                [0.0, 0.01, length / axes.len() as f64]
            };
            let child = format!("{name}_{at}");
            out += &link(&child, 4.0 - 0.5 * at as f64, [0.01, 0.0, length / 20.0]);
            let _ = writeln!(
                out,
                "<joint name=\"{name}_joint_{at}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/>\
                <origin xyz=\"{x} {y} {z}\" rpy=\"0.1 -0.2 {at}\"/><axis xyz=\"{axis}\"/>\
                <limit lower=\"-2\" upper=\"2\" effort=\"50\" velocity=\"4\"/></joint>"
            );
            parent = child;
        }
        parent
    };
    let (x, y, z) = ("1 0 0", "0 1 0", "0 0 1");
    let chest = limb("pelvis", "waist", [0.0, 0.0, 0.15], &[z, y], 0.3);
    limb(&chest, "head", [0.0, 0.0, 0.3], &[z, y], 0.1);
    for (side, sign) in [("left", 1.0), ("right", -1.0)] {
        let hip = [0.0, 0.1 * sign, -0.05];
        limb(
            "pelvis",
            &format!("{side}_leg"),
            hip,
            &[z, x, y, y, y, x],
            -0.8,
        );
        let shoulder = [0.0, 0.2 * sign, 0.25];
        limb(
            &chest,
            &format!("{side}_arm"),
            shoulder,
            &[y, x, z, y, z, y, x],
            0.6,
        );
    }
    out + "</robot>\n"
}

fn read(text: &str) -> Robot {
    let mut sources = SourceMap::new();
    let source = sources.add("robot.urdf", text);
    let (robot, found) = rc_robot::read(&sources, source);
    assert_eq!(render(&sources, &found, Format::Short), "");
    robot
}

fn graph(robot: &Robot) -> Graph {
    let schema = graph_language::builtin("kinematics.gdsl").expect("a schema");
    let graph = robot::document(robot).graph(schema.into(), 1);
    graph.expect("a graph")
}

/// A gripper: one finger slides, the other one follows it.
const GRIPPER: &str = r#"<robot name="gripper">
<link name="palm"><inertial><origin xyz="0.01 0 0.02" rpy="0.1 0.2 0.3"/><mass value="0.8"/>
<inertia ixx="0.003" iyy="0.0025" izz="0.002" ixy="0.0002" ixz="0.0001" iyz="-0.0003"/></inertial></link>
<link name="left"><inertial><origin xyz="0 0.02 0.01" rpy="0 0 0.4"/><mass value="0.1"/>
<inertia ixx="0.0003" iyy="0.00025" izz="0.0002" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="right"><inertial><origin xyz="0 -0.02 0.01" rpy="0.4 0 0"/><mass value="0.1"/>
<inertia ixx="0.0003" iyy="0.00025" izz="0.0002" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="slide" type="prismatic"><parent link="palm"/><child link="left"/>
<origin xyz="0.1 0.2 0.3" rpy="0.4 -0.5 0.6"/><axis xyz="0 1 0"/>
<limit lower="0" upper="0.04" effort="20" velocity="0.1"/></joint>
<joint name="follow" type="prismatic"><parent link="palm"/><child link="right"/>
<origin xyz="0.1 -0.2 0.3" rpy="-0.7 0.8 -0.9"/><axis xyz="0 1 0"/><mimic joint="slide" multiplier="-1"/>
<limit lower="-0.04" upper="0" effort="20" velocity="0.1"/></joint></robot>"#;

/// Where the text of a robot has a joint: xyz and rpy.
fn origin(text: &str, joint: &str) -> [[f64; 3]; 2] {
    let (_, text) = text
        .split_once(&format!("<joint name=\"{joint}\""))
        .expect("a joint");
    let (text, _) = text.split_once("</joint>").expect("its end");
    ["xyz", "rpy"].map(|name| {
        let (_, text) = text.split_once("<origin").expect("an origin");
        let (text, _) = text.split_once('>').expect("its end");
        let Some((_, text)) = text.split_once(&format!("{name}=\"")) else {
            return [0.0; 3];
        };
        let (text, _) = text.split_once('"').expect("its end");
        let mut numbers = text
            .split_whitespace()
            .map(|word| word.parse().expect("a number"));
        std::array::from_fn(|_| numbers.next().expect("three numbers"))
    })
}

/// A rotation about x, then what follows about y, and about z: `Rx·Ry·Rz`, or `Rz·Ry·Rx`.
fn rotation(angles: [f64; 3], order: [usize; 3]) -> [[f64; 3]; 3] {
    let mut all = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for axis in order {
        let (sin, cos) = angles[axis].sin_cos();
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        for row in &mut all {
            (row[b], row[c]) = (row[b] * cos + row[c] * sin, row[c] * cos - row[b] * sin);
        }
    }
    all
}

fn all() -> [(String, usize); 3] {
    [(SIX.to_owned(), 6), (SEVEN.to_owned(), 7), (humanoid(), 30)]
}

/// `joint.pose_wrt_predecessor()` of the schema.
#[test]
fn the_pose_of_each_joint_in_its_predecessor_is_found() {
    for (text, joints) in all().into_iter().chain([(GRIPPER.to_owned(), 2)]) {
        let now = graph(&read(&text)).snapshot();
        let queries = Queries::of(now.schema());
        assert_eq!(queries.faults().count(), 0);
        let moving = now.of_type("Revolute").chain(now.of_type("Prismatic"));
        let moving: Vec<NodeId> = moving.collect();
        assert_eq!(moving.len(), joints);
        for joint in moving {
            let parameters = [("joint", Cell::Node(joint))];
            let rows = queries.run(&now, "pose_wrt_predecessor", parameters, Budget::default());
            let rows = rows.expect("rows").cells;
            // Exactly that pose: the edge from the frame before to that of the joint.
            let frame = |relation: &str| {
                let relation = now.symbol(relation).expect("a relation");
                let ends: Vec<NodeId> = now.out(joint, relation).collect();
                ends[0]
            };
            let into: Vec<EdgeId> = now
                .in_edges(frame("my_frame"), now.symbol("RT"))
                .map(|edge| edge.edge_id())
                .collect();
            let [edge] = into.as_slice() else {
                panic!("{into:?}");
            };
            assert_eq!(
                now.edge(*edge).expect("an edge").from(),
                frame("predecessor")
            );
            let name = now.node(joint).expect("a joint").name();
            let [Cell::Edge(found), Cell::List(numbers)] = rows[0].as_slice() else {
                panic!("{name}: {rows:?}");
            };
            assert_eq!((rows.len(), found, numbers.len()), (1, edge, 6), "{name}");
            let number = |at: usize| match numbers[at] {
                Cell::Float(number) => number,
                ref other => panic!("{name}: {other:?}"),
            };
            let [place, turn] = origin(&text, name);
            assert_eq!(std::array::from_fn(number), place, "{name}");
            let angles = std::array::from_fn(|at| number(3 + at));
            let (ours, theirs) = (rotation(angles, [0, 1, 2]), rotation(turn, [2, 1, 0]));
            let pairs = ours.iter().flatten().zip(theirs.iter().flatten());
            let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-12, "{name}: {worst}");
        }
    }
}

/// The joints that move, with their positions; some follow another one.
fn moved<'r>(robot: &'r Robot, coordinates: &[f64]) -> Vec<(&'r Joint, f64)> {
    let joints = robot.bodies.iter().filter_map(|body| body.joint.as_ref());
    let moved = joints.filter_map(|joint| match joint.motion {
        Motion::Turns {
            coordinate,
            ratio,
            offset,
        }
        | Motion::Slides {
            coordinate,
            ratio,
            offset,
        } => Some((joint, ratio * coordinates[coordinate] + offset)),
        Motion::Fixed => None,
    });
    moved.collect()
}

/// Moves the joints of a graph.
fn turn(graph: &Graph, positions: &[(&Joint, f64)]) {
    let turned = graph.change(Time::ZERO, |edit| {
        for (joint, position) in positions {
            let now = edit.snapshot();
            let named = now.named(&joint.name);
            let is_joint = |node: &NodeId| {
                let node = now.node(*node);
                node.is_ok_and(|n| ["Revolute", "Prismatic"].contains(&n.type_name()))
            };
            let node = named.into_iter().find(is_joint).expect("a joint");
            // The edge from the frame of the joint to that of the link behind it.
            let way = traverse(now, [node]).out("my_frame").nodes().next();
            let edge = now
                .out_edges(way.expect("a frame"), now.symbol("RT"))
                .next();
            let edge = edge.map(|edge| edge.edge_id()).expect("an edge");
            let vector = joint.axis.map(|part| part * position);
            let pose = if matches!(joint.motion, Motion::Slides { .. }) {
                [vector, [0.0; 3]].concat()
            } else {
                let order = EulerOrder::XYZ_MOVING;
                let angles = order.angles(&from_rotation_vector(vector)).angles;
                [[0.0; 3], angles].concat()
            };
            edit.set(edge, "pose", pose.as_slice())?;
        }
        Ok::<(), Error>(())
    });
    turned.expect("a change");
}

fn numbers<const N: usize>(graph: &Snapshot, node: NodeId, name: &str) -> [f64; N] {
    let value = graph.get(node, name).expect("a value");
    std::array::from_fn(|at| value.number(at).expect("a number"))
}

/// Mass, centre of mass and inertia about it of the whole robot, by a walk from its bodies to their
/// frames. All in the frame of a node.
fn masses(graph: &Snapshot, root: NodeId) -> [Vec<f64>; 3] {
    let root = graph.frame(root).expect("a frame");
    let body = Mark(0);
    let bodies = || {
        traverse(graph, graph.of_type("Body"))
            .as_(body)
            .out("fixed_in")
    };
    let parts = bodies().fold(Vec::new(), |mut all, graph, walker| {
        let own = walker.marked(body).expect("a body");
        let Some(mass) = graph.get(own, "mass").and_then(Value::as_f64) else {
            return all;
        };
        let place = graph.frame(walker.node).expect("a frame");
        let place = graph.between(root, place).expect("a transform");
        let [x, y, z] = numbers(graph, own, "centre");
        let centre = place.point(&property_graph::Point::new(x, y, z));
        let [xx, xy, xz, yy, yz, zz] = numbers(graph, own, "inertia");
        let own = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let r = |row: usize, column: usize| place.rotation[(row, column)];
        let mut turned = [[0.0; 3]; 3];
        for (i, row) in turned.iter_mut().enumerate() {
            for (j, cell) in row.iter_mut().enumerate() {
                let pairs = (0..3).flat_map(|k| (0..3).map(move |l| (k, l)));
                *cell = pairs.map(|(k, l)| r(i, k) * own[k][l] * r(j, l)).sum();
            }
        }
        all.push((mass, [centre.x, centre.y, centre.z], turned));
        all
    });
    let mass: f64 = parts.iter().map(|part| part.0).sum();
    let centre: Vec<f64> = (0..3)
        .map(|at| parts.iter().map(|(m, c, _)| m * c[at]).sum::<f64>() / mass)
        .collect();
    let mut inertia = vec![0.0; 9];
    for (m, c, own) in &parts {
        let d: Vec<f64> = (0..3).map(|at| c[at] - centre[at]).collect();
        let square: f64 = d.iter().map(|part| part * part).sum();
        for i in 0..3 {
            for j in 0..3 {
                let about = if i == j { square } else { 0.0 };
                inertia[3 * i + j] += own[i][j] + m * (about - d[i] * d[j]);
            }
        }
    }
    [vec![mass], centre, inertia]
}

fn link(graph: &Snapshot, name: &str) -> NodeId {
    let bodies = traverse(graph, graph.named(name)).has_type("Body");
    bodies.out("fixed_in").nodes().next().expect("a link")
}

#[test]
fn masses_and_poses_are_those_of_pinocchio() {
    let test = "masses_and_poses_are_those_of_pinocchio";
    let packages = rc_test_support::python::packages;
    let Some(python) = packages("pinocchio", "pin==4.1.0\n", test) else {
        return;
    };
    let mut random = fastrand::Rng::with_seed(7);
    let (mut cases, mut ours) = (Vec::new(), Vec::new());
    for (text, _) in all().into_iter().chain([(GRIPPER.to_owned(), 2)]) {
        let robot = read(&text);
        let graph = graph(&robot);
        for _ in 0..5 {
            let count = robot.coordinates.len();
            let positions: Vec<f64> = (0..count).map(|_| random.f64() * 3.0 - 1.5).collect();
            let positions = moved(&robot, &positions);
            turn(&graph, &positions);
            let now = graph.snapshot();
            let mut own: Vec<f64> = masses(&now, link(&now, &robot.bodies[0].name)).concat();
            let mut pairs = Vec::new();
            for _ in 0..5 {
                let pair = [0, 1].map(|_| {
                    let at = random.usize(0..robot.bodies.len());
                    robot.bodies[at].name.as_str()
                });
                let [to, from] = pair.map(|name| now.frame(link(&now, name)).expect("a frame"));
                let between = now.between(to, from).expect("a transform");
                let t = between.translation;
                own.extend([t.x, t.y, t.z]);
                let cells = (0..9).map(|at| between.rotation[(at / 3, at % 3)]);
                own.extend(cells);
                pairs.push(pair);
            }
            ours.push(own);
            cases.push(serde_json::json!({
                "urdf": text,
                "positions": positions.iter().map(|(joint, at)| (&joint.name, at)).collect::<Vec<_>>(),
                "pairs": pairs,
            }));
        }
    }
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/all/robots.py");
    let mut child = Command::new(python)
        .arg(script)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("python");
    let mut input = child.stdin.take().expect("its input");
    let cases = serde_json::Value::from(cases).to_string();
    input.write_all(cases.as_bytes()).expect("written");
    drop(input);
    let output = child.wait_with_output().expect("python");
    assert!(output.status.success(), "the script failed");
    let theirs: Vec<Vec<f64>> = serde_json::from_slice(&output.stdout).expect("numbers");
    assert_eq!(ours.len(), theirs.len());
    for (ours, theirs) in ours.iter().zip(&theirs) {
        assert_eq!(ours.len(), theirs.len());
        let apart = ours.iter().zip(theirs).map(|(a, b)| (a - b).abs());
        let worst = apart.fold(0.0, f64::max);
        assert!(worst < 1e-9, "{worst}");
    }
}
