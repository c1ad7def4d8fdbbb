//! `rcdeploy params` with secret parameters and arrays of strings.

use rc_middleware::RunDirectory;
use rc_runtime::{Component, Core, Description, Ports, StartError, Values, WorkerError, embed};
use std::io::Write;
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::Duration;

static DESCRIPTION: Description = Description {
    name: "vault",
    model_hash: 1,
    middleware: "none",
    period: Duration::from_millis(20),
    parameters: Some(
        r#"{"name":"vault","parameters":[
        {"name":"token","kind":{"scalar":{"type":"string"}},"default":{"text":"a"},"editable":true,"secret":true},
        {"name":"pin","kind":{"scalar":{"type":"int"}},"default":{"int":1},"editable":true,"secret":true},
        {"name":"names","kind":{"scalar":{"type":"string","array":{"min":2,"max":2}}},
         "default":{"array":[{"text":"x"},{"text":"y"}]},"editable":true}]}"#,
    ),
    folder: "/nowhere",
    slots: &[],
    backends: &[],
    types: &[],
    simulates_time: false,
    managed: false,
    converter: None,
    note: b"",
};

/// The last values that the worker received.
static GIVEN: Mutex<(String, i64, Vec<String>)> = Mutex::new((String::new(), 0, Vec::new()));

struct Vault(Core);

impl Component for Vault {
    fn core(&mut self) -> &mut Core {
        &mut self.0
    }

    fn compute(&mut self) -> Result<(), WorkerError> {
        Ok(())
    }

    fn set_parameters(&mut self, values: &Values) {
        let values = (
            values.text("token"),
            values.int("pin"),
            values.texts("names"),
        );
        *GIVEN.lock().expect("the values") = values;
    }
}

#[expect(clippy::unnecessary_wraps, reason = "the runtime expects a `Result`")]
fn start(core: Core, _: &Ports, _: &Values) -> Result<Vault, StartError> {
    Ok(Vault(core))
}

#[test]
fn a_secret_comes_from_standard_input_and_is_not_shown() {
    let network = format!("secret_{}", std::process::id());
    let arguments = ["--network", &network, "--name", "vault"];
    let component = embed(&DESCRIPTION, start, &arguments).expect("to run");
    let set = |changes: &[&str], input: &str| {
        let mut rcdeploy = Command::new(env!("CARGO_BIN_EXE_rcdeploy"))
            .args(["params", "set", &network, "vault"])
            .args(changes)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("rcdeploy");
        let mut stdin = rcdeploy.stdin.take().expect("its input");
        stdin.write_all(input.as_bytes()).expect("to write");
        drop(stdin);
        let ran = rcdeploy.wait_with_output().expect("its output");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("a text");
        (ran.status.code(), text(ran.stdout), text(ran.stderr))
    };
    // One line for each secret, in the order of the command line.
    let (code, out, err) = set(&["token=-", "pin=-"], " 12 34 \n5678\n");
    assert_eq!((code, err.as_str()), (Some(0), ""));
    assert_eq!(out, "pin: *** -> ***\ntoken: *** -> ***\n");
    let given = || GIVEN.lock().expect("the values").clone();
    assert_eq!((given().0.as_str(), given().1), (" 12 34 ", 5678));
    // An array element is a string without quotes; a whole array is written in TOML.
    for (change, names) in [
        ("names[1]=7", ["x", "7"]),
        ("names[0]=-", ["-", "7"]),
        ("names=[\"1\", \"2\"]", ["1", "2"]),
    ] {
        let (code, _, err) = set(&[change], "");
        assert_eq!((code, err.as_str()), (Some(0), ""), "{change}");
        assert_eq!(given().2, names, "{change}");
    }
    let (code, _, err) = set(&["token=-"], "");
    assert_eq!(code, Some(1));
    assert!(err.contains("no secret at standard input"), "{err}");
    let (code, _, err) = set(&["pin=-"], "hunter2\n");
    assert_eq!(code, Some(1));
    assert!(
        err.contains("vault refuses:\n") && !err.contains("hunter2"),
        "{err}"
    );
    assert_eq!((given().0.as_str(), given().1), (" 12 34 ", 5678));
    component.stop();
    component.join().expect("an orderly end");
    assert!(!RunDirectory::of(&network).socket("vault").exists());
}
