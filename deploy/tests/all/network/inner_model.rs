//! Two processes with the same tree of InnerModel, and one that comes late.

use rc_test_site::site::Site;
use serde_json::json;

#[test]
fn two_processes_hold_one_tree_through_changes_and_restarts() {
    let site = Site::new("inner_model");
    site.write_trees("iceoryx2");
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    site.share_a_tree();
    let refused = site.call_tree(
        "world.InnerModelManager.removeNode",
        &json!({"item": "bowll"}),
    );
    assert!(refused.to_string().contains("NonExistingNode"), "{refused}");

    // A process that was killed has the whole tree again.
    let status = site.status();
    let components = status["components"].as_array().expect("a list");
    let copy = components.iter().find(|c| c["name"] == "copy").expect("it");
    let pid = copy["pid"].as_i64().expect("a process");
    let pid = rustix::process::Pid::from_raw(pid as i32).expect("a process");
    rustix::process::kill_process(pid, rustix::process::Signal::KILL).expect("to kill it");
    site.await_component("copy", |c| {
        c["state"] == "running" && c["pid"] != copy["pid"]
    });
    site.await_bowl(300.0);
    site.set_bowl("copy", 400.0);
    site.call_each_operation("world");
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}
