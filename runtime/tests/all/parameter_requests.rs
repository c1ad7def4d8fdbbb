//! Requests for parameters on the management socket, and the configuration file that they save.

use super::parameters::{
    DESCRIPTION, Worker, ask, connect, end, get, receive_reply, run, send, set,
};
use rc_runtime::embed;
use serde_json::{Value, json};
use std::os::unix::fs::PermissionsExt;

#[test]
fn an_overlong_request_is_rejected_and_the_next_one_is_served() {
    let component = run("long", &[]);
    let mut stream = connect("long");
    let changes = json!({ "changes": { "token": "x".repeat(1 << 20) } });
    send(&mut stream, 1, "parameters_set", &changes);
    let reply = receive_reply(&mut stream);
    assert_eq!(
        (&reply["id"], &reply["error"]["code"]),
        (&Value::Null, &json!(-32602))
    );
    let message = reply["error"]["message"].as_str().expect("a text");
    assert!(message.contains("64 KiB"), "{message}");
    send(&mut stream, 2, "status", &Value::Null);
    assert_eq!(receive_reply(&mut stream)["id"], 2);
    end(component);
}

#[test]
fn requests_of_one_connection_are_served_in_order() {
    let file = tempfile::NamedTempFile::new().expect("a file");
    let config = file.path().to_str().expect("a path");
    let component = run("in_order", &["--config", config]);
    let mut stream = connect("in_order");
    for (id, speed) in [(1, 2.0), (2, 3.0)] {
        let changes = json!({ "changes": { "speed": speed } });
        send(&mut stream, id, "parameters_set", &changes);
    }
    send(&mut stream, 3, "parameters_save", &json!({}));
    for id in [1, 2] {
        assert_eq!(receive_reply(&mut stream)["id"], id);
    }
    let saved = receive_reply(&mut stream);
    let expected = json!([{ "path": "speed", "old": 1.0, "new": 3.0 }]);
    assert_eq!(
        (&saved["id"], &saved["result"]["saved"]),
        (&json!(3), &expected)
    );
    assert!(
        std::fs::read_to_string(file.path())
            .expect("the file")
            .contains("speed = 3.0")
    );
    end(component);
}

#[test]
fn a_component_replies_to_pending_requests_before_it_ends() {
    let component = run("ends", &[]);
    let mut streams: Vec<_> = (0..8).map(|_| connect("ends")).collect();
    for (id, stream) in (0..).zip(&mut streams) {
        let changes = json!({ "changes": { "speed": f64::from(id) / 2.0 } });
        send(stream, id, "parameters_set", &changes);
    }
    send(&mut streams[7], 99, "stop", &Value::Null);
    component.join().expect("an orderly end");
    for stream in &mut streams {
        let reply = receive_reply(stream);
        assert!(
            reply["result"].is_object() || reply["error"].is_object(),
            "{reply}"
        );
    }
}

#[test]
fn saving_writes_changed_values_and_keeps_the_rest_of_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("tuned.toml");
    let text = "# Tuned.\n[component]\nlog = \"error\"\n\n[parameters]\nspeed = 1.5   # slow\n# device = \"/dev/x\"\n";
    std::fs::write(&file, text).expect("to write");
    let mode = std::fs::Permissions::from_mode(0o640);
    std::fs::set_permissions(&file, mode).expect("to set");
    let link = folder.path().join("link.toml");
    std::os::unix::fs::symlink(&file, &link).expect("a link");
    let component = run("saves", &["--config", link.to_str().expect("a path")]);

    let nothing = ask("saves", "parameters_save", &json!({}));
    assert_eq!(nothing["result"]["saved"], json!([]), "{nothing}");
    set(
        "saves",
        &json!({ "speed": 2.5, "device": "/dev/b", "token": "n3w" }),
    );
    let saved = ask("saves", "parameters_save", &json!({}));
    assert_eq!(
        saved["result"]["saved"].as_array().map(Vec::len),
        Some(3),
        "{saved}"
    );
    assert!(!saved.to_string().contains("n3w"));
    let expected = text.replace("1.5 ", "2.5 ");
    let expected = expected.replace("# device", "device = \"/dev/b\"\ntoken = \"n3w\"\n# device");
    assert_eq!(std::fs::read_to_string(&file).expect("the file"), expected);
    let metadata = std::fs::metadata(&file).expect("the file");
    // It has a secret now, which is its owner's alone.
    assert_eq!(metadata.permissions().mode() & 0o777, 0o600);
    assert!(link.is_symlink());
    assert_eq!(
        std::fs::read_dir(folder.path()).expect("a folder").count(),
        2
    );

    // Another program edits the same line, then another line.
    set("saves", &json!({ "speed": 3 }));
    std::fs::write(&file, expected.replace("2.5 ", "2.0 ")).expect("to write");
    let conflict = ask("saves", "parameters_save", &json!({}));
    assert_eq!(conflict["error"]["code"], -32003, "{conflict}");
    let message = conflict["error"]["message"].as_str().expect("a text");
    assert!(message.contains("is 2.0 in the file now"), "{message}");
    std::fs::write(&file, expected.replace("# Tuned", "# Fine-tuned")).expect("to write");
    let saved = ask("saves", "parameters_save", &json!({}));
    assert!(saved["result"].is_object(), "{saved}");
    let text = std::fs::read_to_string(&file).expect("the file");
    assert!(
        text.starts_with("# Fine-tuned") && text.contains("speed = 3.0   # slow"),
        "{text}"
    );
    std::fs::remove_file(&file).expect("to remove");
    set("saves", &json!({ "speed": 1 }));
    let gone = ask("saves", "parameters_save", &json!({}));
    assert_eq!(gone["error"]["code"], -32004, "{gone}");
    end(component);
}

#[test]
fn a_configuration_that_is_no_longer_a_writable_file_is_not_saved() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("tuned.toml");
    let text = "[parameters]\nspeed = 1.5\n";
    std::fs::write(&file, text).expect("to write");
    let component = run("odd", &["--config", file.to_str().expect("a path")]);
    set("odd", &json!({ "speed": 2 }));
    let refused = |why: &str| {
        let reply = ask("odd", "parameters_save", &json!({}));
        assert_eq!(reply["error"]["code"], -32004, "{reply}");
        let message = reply["error"]["message"].as_str().expect("a text");
        assert!(message.contains(why), "{message}");
    };
    let mode = |mode| std::fs::Permissions::from_mode(mode);
    std::fs::set_permissions(&file, mode(0o444)).expect("to set");
    refused("the file is read-only");
    assert_eq!(std::fs::read_to_string(&file).expect("the file"), text);
    std::fs::set_permissions(&file, mode(0o600)).expect("to set");
    let hollow = std::fs::File::options().write(true).open(&file);
    hollow
        .expect("the file")
        .set_len(65 << 20)
        .expect("to grow");
    refused("64 MB");
    std::fs::remove_file(&file).expect("to remove");
    // Nothing ever writes into this pipe.
    let mode = rustix::fs::Mode::from_raw_mode(0o600);
    rustix::fs::mknodat(rustix::fs::CWD, &file, rustix::fs::FileType::Fifo, mode, 0)
        .expect("a pipe");
    refused("not a regular file");
    // A start does not wait for it either.
    let arguments = ["--config", file.to_str().expect("a path")];
    let error = embed(&DESCRIPTION, Worker::start, &arguments).expect_err("no configuration");
    assert!(error.to_string().contains("not a regular file"), "{error}");
    // Management still replies, and the component can be stopped.
    assert_eq!(get("odd", "speed")["value"], json!(2.0));
    end(component);
}
