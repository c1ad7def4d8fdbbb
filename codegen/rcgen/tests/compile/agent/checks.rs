//! An agent of DSR keeps its calls; run by `tests/compile.rs`.

use agent_generated::testing::TestContext;
use agent_generated::world::dsr::{DsrGraph, Edge, Node, NodeId, Signal, Signals, Value};
use agent_generated::{Context, Worker, WorkerError, WorldHandlers};

/// Where the robot stands first.
const TURNED: [f64; 3] = [0.0, 0.0, std::f64::consts::FRAC_PI_2];

/// Finds a robot, puts it and its laser into the world, and follows who else is there.
struct Agent {
    signals: Signals,
    robot: Option<NodeId>,
    told: Vec<String>,
}

impl Worker<Context> for Agent {
    fn initialize(ctx: &mut Context) -> Result<Self, WorkerError> {
        Ok(Self {
            signals: Signals::connect(&ctx.g),
            robot: None,
            told: Vec::new(),
        })
    }

    fn compute(&mut self, ctx: &mut Context) -> Result<(), WorkerError> {
        for signal in self.signals.take(&ctx.g) {
            self.slot(ctx, signal);
        }
        let mut g = DsrGraph::new(&mut ctx.g);
        if g.get_node_root().is_none() {
            return self.insert(&mut g);
        }
        Ok(())
    }
}

impl WorldHandlers for Agent {}

impl Agent {
    fn insert(&mut self, g: &mut DsrGraph<'_>) -> Result<(), WorkerError> {
        let mut root = Node::create("root", "root");
        g.insert_node(&mut root)?;
        assert_eq!(g.insert_node(&mut root)?, None, "its name is taken");
        let mut robot = Node::create("omnirobot", "robot");
        g.add_or_modify_attrib_local(&mut robot, "level", 1_i64);
        g.add_or_modify_attrib_local(&mut robot, "color", "Blue");
        self.robot = g.insert_node(&mut robot)?;
        let laser = g.insert_node(&mut Node::create("laser", "laser"))?;
        let laser = laser.expect("it is new");
        let trans = [1.0, 2.0, 0.0];
        assert!(g.insert_or_assign_edge_RT(&root, "robot", trans, TURNED)?);
        let mut rt_api = g.get_rt_api();
        assert!(rt_api.insert_or_assign_edge_RT(&robot, laser, [0.5, 0.0, 0.0], [0.0; 3])?);
        let robot = robot.id.expect("it is there");
        let parent = rt_api.get_translation(root.id.expect("it is there"), robot);
        assert_eq!(parent, Some(trans));
        assert!(g.insert_or_assign_edge(&Edge::create(robot, laser, "has"))?);
        Ok(())
    }

    /// What a signal of DSR would call.
    fn slot(&mut self, ctx: &mut Context, signal: Signal) {
        let g = DsrGraph::new(&mut ctx.g);
        let name = |id| g.get_name_from_id(id).unwrap_or_default();
        self.told.push(match signal {
            Signal::UpdateNode { id, kind } => format!("node {kind} {}", name(id)),
            Signal::UpdateNodeAttr { id, names } => format!("{} {}", name(id), names.join(" ")),
            Signal::UpdateEdge { from, to, kind } => {
                format!("edge {} {kind} {}", name(from), name(to))
            }
            Signal::UpdateEdgeAttr {
                from,
                to,
                kind,
                names,
            } => {
                format!("{} {kind} {} {}", name(from), name(to), names.join(" "))
            }
            Signal::DeleteNode { id } => format!("no node {}", g.get_node(id).is_none()),
            Signal::DeleteEdge { kind, .. } => format!("no edge {kind}"),
        });
    }
}

fn near(found: impl IntoIterator<Item = f64>, expected: &[f64]) {
    let found: Vec<f64> = found.into_iter().collect();
    let is_near = found
        .iter()
        .zip(expected)
        .all(|(a, b)| (a - b).abs() < 1e-9);
    assert!(
        is_near && found.len() == expected.len(),
        "{found:?}, not {expected:?}"
    );
}

#[test]
fn an_agent_keeps_its_calls() -> Result<(), WorkerError> {
    let mut test = TestContext::configured()?;
    let mut agent = Agent::initialize(&mut test)?;
    agent.compute(&mut test)?;
    agent.compute(&mut test)?;
    let told = [
        "node root root",
        "edge root RT robot",
        "edge robot has laser",
    ];
    for line in told {
        assert!(agent.told.iter().any(|own| own == line), "{:?}", agent.told);
    }
    agent.told.clear();

    let mut g = DsrGraph::new(&mut test.g);
    let robot = g.get_node("robot").expect("a robot");
    assert_eq!((robot.id, &*robot.kind), (agent.robot, "omnirobot"));
    assert_eq!(g.get_node_level(&robot), Some(1));
    let color = g.get_attrib_by_name(&robot, "color");
    assert_eq!(color.and_then(Value::as_str), Some("Blue"));
    let names =
        |nodes: Vec<Node>| -> Vec<String> { nodes.into_iter().map(|node| node.name).collect() };
    assert_eq!(names(g.get_nodes_by_type("laser")), ["laser"]);
    assert_eq!(names(g.get_nodes_by_types(&["root", "laser"])).len(), 2);
    assert_eq!(
        (g.get_nodes().len(), g.get_edges_by_type("RT").len()),
        (3, 2)
    );
    let parent = g.get_parent_node(&g.get_node("laser").expect("a laser"));
    assert_eq!(parent.map(|node| node.name).as_deref(), Some("robot"));
    let below = g.get_node_edges_by_type(&robot, "RT");
    assert_eq!(
        below.first().map(|edge| edge.to),
        g.get_id_from_name("laser")
    );
    assert!(g.get_node("nobody").is_none() && g.get_id_from_name("nobody").is_none());

    let inner = g.get_inner_eigen_api();
    let matrix = inner.get_transformation_matrix("root", "laser", None);
    let expected = [
        0.0, -1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 2.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0,
    ];
    near(
        matrix.expect("they are connected").into_iter().flatten(),
        &expected,
    );
    let point = inner.transform("root", [1.0, 0.0, 0.0], "laser", None);
    near(point.expect("a point"), &[1.0, 3.5, 0.0]);
    let pose = inner.transform_axis("root", [0.0, 0.0, 0.0, 0.0, 0.0, 0.5], "robot", None);
    let turned = std::f64::consts::FRAC_PI_2 + 0.5;
    near(pose.expect("a pose"), &[1.0, 2.0, 0.0, 0.0, 0.0, turned]);
    let origin = inner.get_translation_vector("root", "laser", None);
    near(origin.expect("a vector"), &[1.0, 2.5, 0.0]);
    let angles = inner.get_euler_xyz_angles("root", "laser", None);
    near(angles.expect("angles"), &TURNED);
    let rows = inner.get_rotation_matrix("laser", "root", None);
    near(rows.expect("a rotation")[0], &[0.0, 1.0, 0.0]);
    assert!(inner.transform("root", [0.0; 3], "nobody", None).is_none());

    // Another agent sees what it writes.
    let mut robot = robot;
    g.add_or_modify_attrib_local(&mut robot, "level", 2_i64);
    g.add_or_modify_attrib_local(&mut robot, "battery_level", 0.5);
    assert!(!g.add_attrib_local(&mut robot, "battery_level", 0.75));
    assert!(g.modify_attrib_local(&mut robot, "battery_level", 0.25));
    assert!(!g.modify_attrib_local(&mut robot, "speed", 0.25));
    assert!(g.remove_attrib_local(&mut robot, "color"));
    assert!(g.update_node(&robot)?);
    let root = g.get_node_root().expect("a root");
    assert!(
        g.get_rt_api()
            .insert_or_assign_edge_RT(&root, "robot", [3.0, 2.0, 0.0], [0.0; 3])?
    );
    assert!(g.delete_edge("robot", "laser", "has")?);
    assert!(!g.delete_edge("robot", "laser", "has")?, "it is gone");
    assert!(g.delete_node("laser")?);
    assert!(!g.delete_node("laser")?, "it is gone");
    agent.compute(&mut test)?;
    agent.told.sort();
    let told = [
        "no edge RT",
        "no edge has",
        "no node true",
        "robot battery_level color level",
        "root RT robot rt_rotation_euler_xyz rt_translation",
    ];
    let mut found: Vec<Vec<&str>> = agent
        .told
        .iter()
        .map(|line| line.split(' ').collect())
        .collect();
    for words in &mut found {
        let fixed = if words[0] == "root" { 3 } else { 1 };
        words[fixed..].sort_unstable();
    }
    let mut expected: Vec<Vec<&str>> = told.iter().map(|line| line.split(' ').collect()).collect();
    for words in &mut expected {
        let fixed = if words[0] == "root" { 3 } else { 1 };
        words[fixed..].sort_unstable();
    }
    assert_eq!(found, expected);

    // What the schema does not allow is an error, and changes nothing.
    let mut g = DsrGraph::new(&mut test.g);
    let refused = g.insert_or_assign_edge_RT(&root, "robot", [1e6, 0.0, 0.0], [0.0; 3]);
    assert!(refused.is_err(), "{refused:?}");
    assert!(
        g.insert_node(&mut Node::create("omnirobot", "other"))?
            .is_some()
    );
    let others = test.g.others();
    test.g.meet(&others)?;
    assert!(others.snapshot().named("other").next().is_some());
    Ok(())
}
