//! The operation `follow` of `Simulation`: the scene follows a tree.

use crate::start;
use rcis::SpecificWorker;
use rcis_generated::testing::TestContext;
use rcis_generated::{Attribute, Followed, Node, Pose, Simulation};

const SCENE: &str = r#"<innerModel>
    <transform id="shed" tx="500"/>
    <transform id="a"><transform id="b"/></transform>
    <human id="ann"/>
    <differentialrobot id="base"><joint id="pan" axis="y" min="-1" max="1"/></differentialrobot>
</innerModel>"#;

fn node(id: &str, parent: &str, element: &str) -> Node {
    Node {
        id: id.into(),
        parent: parent.into(),
        element: element.into(),
        position: 0.0,
        attributes: Vec::new(),
    }
}

/// What a tree with the nodes of the scene says.
fn tree() -> Vec<Node> {
    vec![
        node("shed", "root", r#"<transform id="shed" tx="500"/>"#),
        node("ann", "root", r#"<human id="ann"/>"#),
        node("a", "root", r#"<transform id="a"/>"#),
        node("b", "a", r#"<transform id="b"/>"#),
        node("base", "root", r#"<differentialrobot id="base"/>"#),
        node(
            "pan",
            "base",
            r#"<joint id="pan" axis="y" min="-1" max="1"/>"#,
        ),
    ]
}

struct Instance(SpecificWorker, TestContext);

impl Instance {
    fn follow(&mut self, whole: bool, removed: &[&str], nodes: Vec<Node>) -> Followed {
        let removed = removed.iter().map(|id| (*id).to_owned()).collect();
        Simulation::follow(&mut self.0, &mut self.1, whole, removed, nodes)
    }

    /// The coordinate x of a node in another one. `None` if one of them is not there.
    fn x(&mut self, base: &str, id: &str) -> Option<f64> {
        let (id, base) = (id.to_owned(), base.to_owned());
        let pose = Simulation::get_pose(&mut self.0, &mut self.1, String::new(), id, base);
        Some(pose.ok()?.x)
    }

    fn digest(&mut self) -> i64 {
        let digest = Simulation::get_digest(&mut self.0, &mut self.1, String::new());
        digest.expect("a digest")
    }

    fn print(&mut self) -> String {
        let text = Simulation::print(&mut self.0, &mut self.1, String::new());
        text.expect("a text")
    }
}

fn instance() -> Instance {
    let (worker, test) = start(SCENE);
    Instance(worker, test)
}

#[test]
fn what_a_tree_says_anew_changes_and_the_rest_goes_on() {
    let mut one = instance();
    let before = one.digest();
    let followed = one.follow(true, &[], tree());
    assert_eq!((followed.nodes, followed.unmade), (6, Vec::new()));
    assert_eq!(one.digest(), before, "the tree has what the scene has");

    // The robot has driven, and the tree says something else of it.
    let pose = Pose {
        x: 700.0,
        ..Pose::default()
    };
    let (id, root) = ("base".to_owned(), "root".to_owned());
    let moved = Simulation::teleport(&mut one.0, &mut one.1, String::new(), id, root, pose);
    moved.expect("a node");
    let mut base = tree().remove(4);
    base.attributes = vec![Attribute {
        name: "owner".into(),
        type_: "string".into(),
        value: "Ana".into(),
    }];
    one.follow(false, &[], vec![base.clone()]);
    assert_eq!(one.x("root", "base"), Some(700.0));
    // A tree that says all of it again moves nothing.
    let mut again = tree();
    again[4] = base.clone();
    let digest = one.digest();
    one.follow(true, &[], again);
    assert_eq!(one.digest(), digest);
    base.element = r#"<differentialrobot id="base" tx="100"/>"#.into();
    one.follow(false, &[], vec![base]);
    assert_eq!(one.x("root", "base"), Some(100.0));

    // Nodes come, a joint turns, and nodes go, but for one of another client.
    let mut pan = tree().remove(5);
    pan.position = 0.5;
    let ball = node("ball", "pan", r#"<sphere id="ball" tx="10" radius="5"/>"#);
    let followed = one.follow(false, &[], vec![pan, ball]);
    assert_eq!((followed.nodes, followed.unmade), (7, Vec::new()));
    let x = one.x("base", "ball").expect("a ball");
    assert!((x - 10.0 * 0.5_f64.cos()).abs() < 1e-9, "{x}");
    let (root, hut) = ("root".to_owned(), r#"<transform id="hut"/>"#.to_owned());
    let added = Simulation::add(&mut one.0, &mut one.1, String::new(), root, hut);
    added.expect("a node");
    let followed = one.follow(false, &["a", "b", "hut"], Vec::new());
    assert_eq!((followed.nodes, one.x("root", "hut")), (5, Some(0.0)));
    assert_eq!([one.x("root", "a"), one.x("root", "b")], [None, None]);
    assert_eq!(one.x("root", "shed"), Some(500.0));
    // Of the scene, what the tree does not have goes, but no skeleton of a person that it has.
    let person = tree().remove(1);
    let c = node("c", "root", r#"<transform id="c"/>"#);
    let followed = one.follow(true, &[], vec![person, c]);
    assert_eq!((followed.nodes, followed.unmade), (2, Vec::new()));
    let there = ["base", "shed", "hut", "ann_head", "c"].map(|id| one.x("root", id).is_some());
    assert_eq!(there, [false, false, false, true, true]);
}

#[test]
fn nodes_move_to_any_parents_and_one_that_is_removed_keeps_none_that_move_away() {
    let mut one = instance();
    one.follow(true, &[], tree());
    let a = node("a", "b", r#"<transform id="a"/>"#);
    let b = node("b", "root", r#"<transform id="b" tx="5"/>"#);
    let followed = one.follow(false, &[], vec![b, a]);
    assert_eq!(followed.unmade, []);
    assert_eq!(
        (one.x("b", "a"), one.x("root", "a")),
        (Some(0.0), Some(5.0))
    );
    let a = node("a", "base", r#"<transform id="a" tx="1"/>"#);
    one.follow(false, &["b"], vec![a]);
    assert_eq!([one.x("base", "a"), one.x("root", "b")], [Some(1.0), None]);
    // One that was removed and is another node of the same name.
    let a = node("a", "base", r#"<sphere id="a" radius="5"/>"#);
    one.follow(false, &["a"], vec![a]);
    assert!(one.print().contains(r#"<sphere id="a""#), "{}", one.print());
}

#[test]
fn a_node_that_a_client_has_moved_stays_when_its_new_parent_goes() {
    let mut one = instance();
    let hand = node("hand", "pan", r#"<transform id="hand"/>"#);
    let mut all = tree();
    all.push(hand);
    one.follow(true, &[], all);
    for [id, parent] in [["a", "hand"], ["shed", "b"]] {
        let (id, parent) = (id.to_owned(), parent.to_owned());
        let moved = Simulation::move_to(&mut one.0, &mut one.1, String::new(), id, parent);
        moved.expect("two nodes");
    }
    let followed = one.follow(false, &["hand", "pan", "base"], Vec::new());
    assert_eq!((followed.nodes, followed.unmade), (4, Vec::new()));
    let there = ["a", "b", "shed", "hand"].map(|id| one.x("root", id));
    assert_eq!(there, [Some(0.0), Some(0.0), Some(500.0), None]);
}

#[test]
fn a_node_that_cannot_be_in_the_scene_is_told_and_the_others_are_there() {
    let mut one = instance();
    let (root, text, other, mesh, orphan, wrong) = (
        node("root", "", r#"<transform id="root"/>"#),
        node("text", "root", "<transform"),
        node("other", "root", r#"<transform id="another"/>"#),
        node("mesh", "root", r#"<mesh id="mesh" file="/etc/passwd"/>"#),
        node("orphan", "nobody", r#"<transform id="orphan"/>"#),
        Node {
            position: f64::NAN,
            ..tree().remove(5)
        },
    );
    let ball = node("ball", "root", r#"<sphere id="ball" radius="5"/>"#);
    let all = vec![root, text, other, mesh, orphan, wrong, ball];
    let before = one.print();
    let followed = one.follow(false, &[], all);
    let unmade: Vec<&str> = followed.unmade.iter().map(|one| one.id.as_str()).collect();
    assert_eq!(unmade, ["root", "text", "other", "mesh", "orphan", "pan"]);
    assert!(followed.unmade.iter().all(|one| !one.what.is_empty()));
    assert_eq!((followed.nodes, one.x("root", "ball")), (1, Some(0.0)));
    let followed = one.follow(false, &["ball"], Vec::new());
    assert_eq!((followed.nodes, one.print()), (0, before));
}
