//! A component in Python with a tree of InnerModel and a window for it.

use crate::python_site::{up, workspace};
use rc_test_site::site::Site;
use std::path::Path;

const CDSL: &str = "Component gazer\n{\n    Communications {};\n    language python;\n    \
                    options InnerModelViewer;\n    parameters \"gazer.pdsl\";\n    period 20ms;\n};\n";

const WORKER: &str = r#"from gazer import Context, Worker


class SpecificWorker(Worker):
    def initialize(self, ctx: Context) -> None:
        before = ctx.tree.snapshot()
        print("joints", [node for node in before.nodes() if before.joint(node) is not None][:2])
        print("set", ctx.tree.change(joints={"joint_1": 0.5, "joint_2": 9.0}))
        now = ctx.tree.snapshot()
        print("version", now.version - before.version, before.joint("joint_1"), now.joint("joint_1"))
        print("moved", before.pose("world", "link_2") != now.pose("world", "link_2"))
        x, y, z = now.transform("world", (0.0, 0.0, 0.0), "arm")
        print("arm", x, y, z, ctx.tree.matrix("world", "arm")[:3, 3].tolist())
        try:
            ctx.tree.change(joints={"joint_1": 1.0}, poses={"nowhere": (0, 0, 0, 0, 0, 0)})
        except ValueError as error:
            print("refused", error, ctx.tree.snapshot().joint("joint_1"))

    def compute(self, ctx: Context) -> None:
        pass
"#;

#[test]
fn a_worker_in_python_has_the_tree_of_its_component() {
    let test = "a_worker_in_python_has_the_tree_of_its_component";
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../innermodel/scenes");
    let scenes = scenes.canonicalize().expect("the scenes");
    let pdsl = format!(
        "ComponentParams gazer\n{{\n    viewer bool false T;\n    inner_model path \"{}\";\n}};\n",
        scenes.join("arm.xml").display()
    );
    let files = [
        ("gazer.cdsl", CDSL),
        ("gazer.pdsl", &pdsl),
        ("src/specific_worker.py", WORKER),
    ];
    let Some(site) = workspace("python_tree", "gazer", &files, test) else {
        return;
    };
    site.write_ddsl(
        "Deployment patrol\n{\n    Component gazer { cdsl \"gazer/gazer.cdsl\"; };\n};\n",
    );
    let started = up(&site, &[]);
    assert_eq!(started.code, 0, "{started:?}\n{}", site.log("gazer"));
    site.await_in_log("gazer", "refused ");
    let log = site.log("gazer");
    for line in [
        "joints ['joint_1', 'joint_2']",
        // Within the limit of the joint.
        "set {'joint_1': 0.5, 'joint_2': 2.0}",
        "version 1 0.0 0.5",
        "moved True",
        "arm 0.0 700.0 -200.0 [0.0, 700.0, -200.0]",
    ] {
        assert!(log.contains(line), "{line}: {log}");
    }
    let refused = log.lines().find(|line| line.starts_with("refused "));
    let refused = refused.expect("a line");
    assert!(refused.contains("nowhere"), "{refused}");
    assert!(refused.ends_with(" 0.5"), "nothing has changed: {refused}");

    // There is no display.
    let show = ["params", "set", &site.network, "gazer", "viewer=true"];
    let shown = site.rcdeploy(&show, false);
    assert_ne!(shown.code, 0, "{shown:?}");
    assert!(shown.stderr.contains("DISPLAY"), "{shown:?}");
    let get = ["params", "get", &site.network, "gazer", "viewer"];
    assert_eq!(site.rcdeploy(&get, false).stdout, "viewer = false\n");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();

    site.write_ddsl(
        "Deployment patrol\n{\n    Component gazer { cdsl \"gazer/gazer.cdsl\"; parameters { viewer true; }; };\n};\n",
    );
    assert_ne!(up(&site, &[]).code, 0);
    let log = site.log("gazer");
    assert!(log.contains("the parameter `viewer` is true: "), "{log}");
    Site::until("it ends", || !site.directory().path().exists());
}
