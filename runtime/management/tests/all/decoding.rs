//! Requests and texts from outside, as they are decoded.

use super::golden::text;
use rc_lifecycle::Transition;
use rc_management::{agent, component, link, rpc, supervisor};
use serde_json::{Value, json};

#[test]
fn an_invalid_request_is_rejected_with_the_allowed_form() {
    let error = |line: &str| {
        let call = rpc::Call::parse(line.as_bytes());
        let error = call.and_then(component::Request::decode).expect_err(line);
        (error.code, error.message)
    };
    assert_eq!(error("hello"), (-32700, text("this is not JSON")));
    let unknown = "unknown method `dance`; there are `status`, `parameters`, `parameters_set`, `parameters_save`, `period`, `emergency`, `fire`, `lifecycle`, `stop`, `describe`, `clocks`, `follow`, `hops`, `tap`, `call`, `sample`";
    assert_eq!(error(r#"{"method":"dance"}"#), (-32601, text(unknown)));
    assert_eq!(error("[]").0, -32601);
    for (line, message) in [
        (
            r#"{"method":"emergency"}"#,
            r#"`emergency` takes {"active": true|false}"#,
        ),
        (
            r#"{"method":"period","params":{"ms":0.01}}"#,
            r#"`period` takes {"ms": 0.1 … 3600000}"#,
        ),
        (
            r#"{"method":"parameters","params":{"paths":[7]}}"#,
            r#"`parameters` takes {} or {"paths": ["motors[0].max", …]}"#,
        ),
        (
            r#"{"method":"parameters_set","params":{"changes":{}}}"#,
            r#"`parameters_set` takes {"changes": {"motors[0].max": 1.5, …}}"#,
        ),
    ] {
        assert_eq!(error(line), (-32602, text(message)));
    }
}

#[test]
fn numbers_of_a_request_have_bounds() {
    let is_accepted = |method: &str, params: Value| {
        let line = json!({ "method": method, "params": params }).to_string();
        let call = rpc::Call::parse(line.as_bytes());
        let decoded = call.and_then(component::Request::decode);
        let code = decoded.as_ref().err().map(|error| error.code);
        assert!(matches!(code, None | Some(rpc::Error::INVALID_PARAMS)));
        decoded.is_ok()
    };
    for (ms, expected) in [(0.099, false), (0.1, true), (3.6e6, true), (3.601e6, false)] {
        assert_eq!(is_accepted("period", json!({ "ms": ms })), expected, "{ms}");
    }
    for (ms, expected) in [(0, false), (1, true), (600_000, true), (600_001, false)] {
        let call = json!({ "slot": "laser", "body": "", "timeout_ms": ms });
        assert_eq!(is_accepted("call", call), expected, "{ms}");
    }
    let pair = json!({ "input": { "slot": "laser", "operation": "scan" } });
    for (count, expected) in [(0, true), (64, true), (65, false)] {
        let pairs = vec![pair.clone(); count];
        assert_eq!(is_accepted("follow", json!({ "pairs": pairs })), expected);
    }
}

#[test]
fn a_command_names_components_and_shuts_none_down() {
    use supervisor::Request;
    let decode = |method: &str, params: Value| {
        let line = json!({ "method": method, "params": params }).to_string();
        let call = rpc::Call::parse(line.as_bytes());
        call.and_then(Request::decode)
            .map_err(|error| error.message)
    };
    for method in ["start", "stop", "restart"] {
        let usage = format!(r#"`{method}` takes {{"names": ["lidar", …]}}"#);
        assert_eq!(decode(method, json!({ "names": [] })), Err(usage));
        let decoded = decode(method, json!({ "names": ["lidar"] }));
        assert_eq!(rpc::request(1, &decoded.expect("a command")), {
            let names = json!({ "names": ["lidar"] });
            let line = json!({ "id": 1, "jsonrpc": "2.0", "method": method, "params": names });
            (line.to_string() + "\n").into_bytes()
        });
    }
    let lifecycle = |transition: &str| decode("lifecycle", json!({ "transition": transition }));
    assert_eq!(
        lifecycle("activate"),
        Ok(Request::Lifecycle {
            transition: Transition::Activate,
            names: Vec::new(),
        })
    );
    assert!(lifecycle("shutdown").is_err());
}

/// Tools print these words, and scripts compare them with those of JSON.
#[test]
fn states_and_clocks_are_printed_as_they_stand_in_json() {
    use component::{ClockKind, State};
    use supervisor::ComponentState;
    for state in [
        State::Starting,
        State::Running,
        State::Emergency,
        State::Stopping,
    ] {
        assert_eq!(json!(state), state.word());
        assert_eq!(json!(state), state.to_string());
        let of_supervisor = ComponentState::from(state);
        assert_eq!(json!(state), json!(of_supervisor));
    }
    for kind in [
        ClockKind::System,
        ClockKind::Simulated,
        ClockKind::Source,
        ClockKind::Nodes,
    ] {
        assert_eq!(json!(kind), kind.word());
    }
    for state in [
        ComponentState::Waiting,
        ComponentState::Starting,
        ComponentState::Running,
        ComponentState::Emergency,
        ComponentState::Stopping,
        ComponentState::Done,
        ComponentState::Failed,
        ComponentState::Hung,
        ComponentState::Stopped,
    ] {
        assert_eq!(json!(state), state.to_string());
    }
}

#[test]
fn each_finding_of_an_error_has_a_line_in_its_reason() {
    let finding = |help: Option<&str>| rpc::Finding {
        code: text("out-of-range"),
        help: help.map(text),
        message: text("too much"),
    };
    let plain = rpc::Error::new(rpc::Error::INVALID_PARAMS, "no");
    assert_eq!(plain.reason(), "no");
    let error = rpc::Error {
        data: Some(rpc::ErrorData {
            findings: vec![finding(None), finding(Some("at most 1"))],
        }),
        ..plain
    };
    assert_eq!(
        error.reason(),
        "\n  error[out-of-range]: too much\n  error[out-of-range]: too much (at most 1)"
    );
    // A tool shows usage for the first three, and not for the others.
    for (code, expected) in [
        (rpc::Error::INVALID_PARAMS, true),
        (rpc::Error::WORKER_REFUSES, true),
        (rpc::Error::FILE, true),
        (rpc::Error::WORKER_TIMEOUT, false),
        (rpc::Error::SYSTEM, false),
    ] {
        assert_eq!(rpc::Error::new(code, "").is_input(), expected, "{code}");
    }
}

#[test]
fn optional_and_unknown_parameters_are_accepted() {
    use component::Request;
    let request = |line: &str| {
        let call = rpc::Call::parse(line.as_bytes());
        call.and_then(Request::decode).expect(line)
    };
    assert_eq!(request(r#"{"method":"status"}"#), Request::Status);
    assert_eq!(
        request(r#"{"method":"status","params":{"x":1}}"#),
        Request::Status
    );
    let all = Request::Parameters { paths: None };
    assert_eq!(request(r#"{"method":"parameters"}"#), all);
    assert_eq!(
        request(r#"{"method":"parameters","params":{"paths":null}}"#),
        all
    );
}

/// Texts of other processes reach messages, terminals and JSON of tools.
#[test]
fn foreign_texts_are_cleaned_where_they_enter() {
    let long = format!("a\nforged: \u{1b}[2J{}", "x".repeat(100_000));
    let clean = |text: &str| {
        assert!(text.starts_with("a\\nforged: \\u{1b}[2Jxxx"), "{text}");
        assert_eq!(text.chars().count(), 257);
    };
    let line = json!({"id": 1, "error": {"code": -32001, "message": long, "data": {"findings": [
        {"code": "x", "help": long, "message": long}]}}});
    let error: rc_management::rpc::Error =
        serde_json::from_value(line["error"].clone()).expect("an error");
    // A reason may have lines, but no more than a reader needs.
    assert!(error.message.starts_with("a\nforged: \\u{1b}[2J"));
    assert!(error.message.chars().count() < 10_000);
    let finding = &error.data.as_ref().expect("its data").findings[0];
    clean(&finding.message);
    clean(finding.help.as_deref().expect("a help"));
    let heartbeat = json!({"method": "heartbeat", "params": {"age_ms": 1, "mismatches": [long],
        "silent": {(long.clone()): 7}, "overruns": {"what": long, "ms": 1.0, "period_ms": 1.0}}});
    let message = link::ComponentMessage::decode(heartbeat.to_string().as_bytes());
    let Ok(link::ComponentMessage::Heartbeat(heartbeat)) = message else {
        panic!("{message:?}");
    };
    clean(&heartbeat.mismatches[0]);
    heartbeat.silent.keys().for_each(|key| clean(key));
    clean(&heartbeat.overruns.expect("an overrun").what);
    let note = json!({"note": long});
    let note: agent::AgentMessage = serde_json::from_value(note).expect("a note");
    assert!(matches!(note, agent::AgentMessage::Note(text) if !text.contains('\u{1b}')));
}

#[test]
fn a_process_ends_well_with_code_zero_or_when_it_was_asked() {
    let exit = |success, signal| agent::Exit {
        success,
        signal,
        text: String::new(),
    };
    assert!(exit(true, None).is_done(false) && exit(true, None).is_done(true));
    assert!(!exit(false, None).is_done(false) && !exit(false, None).is_done(true));
    // SIGTERM counts only if it was asked for, and SIGKILL never does.
    assert!(exit(false, Some(15)).is_done(true) && !exit(false, Some(15)).is_done(false));
    assert!(!exit(false, Some(9)).is_done(true));
}

#[test]
fn only_texts_are_given_without_quotes() {
    let is_text = |path: &str, allowed: &str| {
        let status = json!({ "path": path, "value": null, "allowed": allowed,
            "editable": true, "restart": false, "secret": false });
        serde_json::from_value::<component::ParameterStatus>(status)
            .expect("a parameter")
            .is_text()
    };
    assert!(is_text("mode", "string, one of slow, fast") && is_text("device", "path"));
    assert!(is_text("tags[2]", "string[] of any length") && !is_text("tags", "string[]"));
    assert!(!is_text("gain", "float, from 0 to 1") && !is_text("gains[0]", "float[3]"));
}

#[test]
fn notifications_of_a_supervisor_are_decoded() {
    use rc_management::supervisor::Notification;
    let missed = json!({ "events": 5 });
    assert_eq!(
        Notification::decode("missed", missed.clone()),
        Some(Notification::Missed { events: 5 })
    );
    assert_eq!(Notification::decode("unknown", missed), None);
}
