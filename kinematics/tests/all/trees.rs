//! Robots of `InnerModel` files move as the tree says.

use crate::load_beside;
use innermodel::{InnerModel, Point, Time};
use rc_robot::State;

const TREE: &str = "<innerModel>
    <transform id=\"base\" tx=\"1000\" rx=\"0.3\" mass=\"2\">
        <joint id=\"shoulder\" axis=\"z\" ty=\"300\" min=\"-2\" max=\"2\" rz=\"0.2\">
            <joint id=\"elbow\" axis=\"x\" tz=\"200\" min=\"-2\" max=\"2\" ry=\"-0.4\">
                <translation id=\"rail\" tx=\"50\">
                    <prismaticJoint id=\"slide\" axis=\"y\" min=\"0\" max=\"400\">
                        <translation id=\"hand\" tx=\"500\" ty=\"-20\" tz=\"70\">
                            <mesh id=\"shape\" file=\"no_such.obj\"/>
                        </translation>
                    </prismaticJoint>
                </translation>
            </joint>
        </joint>
    </transform>
</innerModel>";

#[test]
fn poses_are_those_of_innermodel() {
    let text = "import \"tree.xml\"; Kinematics cell { frames innermodel; lengths mm; solver fk { pose hand in root; }; };";
    let (cell, found) = load_beside(text, &[("tree.xml", TREE)]);
    assert_eq!(found, "");
    let cell = cell.expect("a cell");
    assert_eq!(cell.robot.coordinates, ["shoulder", "elbow", "slide"]);
    let model = InnerModel::parse(TREE).expect("a tree");
    for at in [[0.0, 0.0, 0.0], [0.7, -0.4, 120.0], [-1.1, 1.9, 300.0]] {
        for (joint, position) in ["shoulder", "elbow", "slide"].into_iter().zip(at) {
            let moved = model.change(Time::ZERO, |edit| edit.set_joint(joint, position));
            moved.expect("a joint");
        }
        let now = model.snapshot();
        let state = State::still(at.to_vec());
        let pose = cell.solvers[0].run(&state, &[0.0; 3], &[]).expect("a pose");
        for point in [
            [0.0, 0.0, 0.0],
            [100.0, 0.0, 0.0],
            [0.0, 100.0, 0.0],
            [7.0, 8.0, 100.0],
        ] {
            let there = now.transform("root", Point::new(point[0], point[1], point[2]), "hand");
            let there = there.expect("a frame");
            for row in 0..3 {
                let own: f64 = (0..3).map(|at| pose[4 * row + at] * point[at]).sum();
                let own = own + pose[4 * row + 3];
                assert!((own - there[row]).abs() < 1e-8, "{at:?}: {own} {there}");
            }
        }
    }
}

#[test]
fn robots_of_trees_have_forces_and_their_mistakes_a_place() {
    let two = "import \"tree.xml\" as left; import \"tree.xml\" as right; Kinematics cell {
        fixed right.root in left.root at 1, 0, 0; solver hold { pose left.hand in right.hand; efforts; }; };";
    let (cell, found) = load_beside(two, &[("tree.xml", TREE)]);
    assert_eq!(found, "");
    assert_eq!(cell.expect("a cell").robot.coordinates.len(), 6);
    let one = "import \"tree.xml\"; Kinematics cell { solver fk { pose hand in root; }; };";
    for (from, to, what) in [
        ("axis=\"z\"", "axis=\"w\"", "tree.xml:3:"),
        ("tx=\"1000\"", "tx=\"far\"", "tree.xml:2:"),
        ("</innerModel>", "", "tree.xml:"),
        ("id=\"elbow\"", "id=\"base\"", "tree.xml:4:"),
    ] {
        let wrong = TREE.replacen(from, to, 1);
        let (_, found) = load_beside(one, &[("tree.xml", &wrong)]);
        assert!(
            found.contains(what) && found.contains("error["),
            "{to}: {found}"
        );
    }
}
