//! Images of one camera to three subscribers.

use rc_test_site::site::Site;

const CAMERA: &str = include_str!("../../../../components/networks/camera.ddsl");

/// Every received and every requested image is read in shared memory and is complete.
#[test]
fn images_are_read_in_shared_memory() {
    let site = Site::new("camera");
    site.write_ddsl(&CAMERA.replace("Deployment camera", "Deployment patrol"));
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    for name in ["left", "middle", "right"] {
        // One second of images lies between two lines of the log.
        Site::until("pictures", || {
            site.count_in_log(name, "asked for picture") >= 2
        });
        let status = site.ask(name, "status");
        assert_eq!(status["compute"]["errors"], 0, "{status}");
        assert_eq!(status["last_error"], serde_json::Value::Null, "{status}");
        let slots = status["slots"].as_array().expect("a list");
        let seen = slots.iter().find(|slot| slot["name"] == "CameraPub");
        let seen = seen.expect("the subscribed slot");
        assert!(seen["handlers"]["count"].as_u64() > Some(0), "{status}");
        assert_eq!(seen["handlers"]["errors"], 0, "{status}");
    }
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}
