//! A C++ program on Fast DDS, the library of `rmw_fastrtps`: topics, and services in its mapping.
//! The program is `middleware/ros2/tests/stranger/fast.cpp`, the component is `interop`.

use crate::network::dds::{Domain, ExternalProgram, Over};
use crate::network::ros_python::interop_client;
use rc_test_site::site::Site;
use rc_test_support::debian;
use rc_test_support::python::{run, skipped};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;
use std::time::Duration;

fn domain(name: &str, id: u32) -> Domain {
    Domain::over(Over::Ros2, name, id)
}

/// The program, compiled once by the compiler of the system. Without a compiler or the library,
/// `test` is listed as skipped.
fn program(test: &str) -> Option<&'static Path> {
    static MADE: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    match MADE.get_or_init(make) {
        Ok(program) => Some(program),
        Err(reason) => {
            skipped(test, reason);
            None
        }
    }
}

/// Compiles with the library of the system, or else with one that is unpacked below the target
/// folder.
fn make() -> Result<PathBuf, String> {
    run(Path::new("c++"), &["--version"])?;
    let works = |place: Option<&Path>| match place {
        Some(place) => Unpacked::new(place).libraries.exists(),
        None => compiled(None).is_ok(),
    };
    let place = debian::provided("libfastrtps-dev", &works)?;
    compiled(place.as_deref().map(Unpacked::new).as_ref())
}

/// The folders of headers and libraries that are not installed.
struct Unpacked {
    headers: [PathBuf; 2],
    libraries: PathBuf,
}

impl Unpacked {
    fn new(place: &Path) -> Self {
        let machine = format!("{}-linux-gnu", std::env::consts::ARCH);
        let headers = place.join("usr/include");
        Self {
            headers: [headers.join(&machine), headers],
            libraries: place.join("usr/lib").join(machine),
        }
    }
}

fn compiled(unpacked: Option<&Unpacked>) -> Result<PathBuf, String> {
    let source = Over::Ros2.external_programs().join("fast.cpp");
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fast");
    // Another test run may execute the program.
    let new = program.with_extension(std::process::id().to_string());
    let mut args = vec!["-std=c++17".to_owned(), source.display().to_string()];
    args.extend(["-o".to_owned(), new.display().to_string()]);
    if let Some(Unpacked { headers, libraries }) = unpacked {
        let libraries = libraries.display();
        args.extend(headers.iter().map(|path| format!("-I{}", path.display())));
        args.push(format!("-L{libraries}"));
        // The libraries find the libraries that they need there.
        args.push(format!("-Wl,--disable-new-dtags,-rpath,{libraries}"));
    }
    args.extend(["-lfastrtps", "-lfastcdr"].map(str::to_owned));
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    run(Path::new("c++"), &args)?;
    std::fs::rename(&new, &program).map_err(|e| format!("{}: {e}", program.display()))?;
    Ok(program)
}

fn external(domain: &Domain, program: &Path, args: &[&str]) -> ExternalProgram {
    domain.beside(Command::new(program), args)
}

/// Strings of every length modulo four travel both ways, in one packet and in several.
#[test]
fn strings_travel_between_a_component_and_fast_dds() {
    let Some(program) = program("strings_travel_between_a_component_and_fast_dds") else {
        return;
    };
    let domain = domain("ros_fast_talk", 31);
    let component = domain.start(&[]);
    let lengths = [
        "0", "1", "2", "3", "1300", "1301", "1302", "1303", "2051", "65535", "204801", "1048575",
    ];
    let mut talker = external(&domain, program, &[&["talk"], &lengths[..]].concat());
    talker.says("met");
    Site::until("the component finds the talker", || {
        domain.slot("Talk")["peers"] == 1 && domain.slot("Gossip")["peers"] == 1
    });
    talker.write("\n");
    assert_eq!(talker.end(), ["heard 12"], "{}", component.log());
}

/// A client calls often, is refused, and sends and receives much.
#[test]
fn a_client_on_fast_dds_calls_a_component() {
    let Some(program) = program("a_client_on_fast_dds_calls_a_component") else {
        return;
    };
    let domain = domain("ros_fast_ask", 32);
    let component = domain.start(&[]);
    let said = external(&domain, program, &["ask"]).end();
    let expected = [
        "added 200",
        "refused 24",
        "noted 1: from Fast DDS",
        "noted long ones",
        "a large response",
    ];
    assert_eq!(said, expected, "{}", component.log());
    let calls = domain.slot("Interop");
    assert_eq!(calls["handlers"]["count"], 200 + 24 + 7, "{calls}");
}

/// A server replies, throws, and is killed.
#[test]
fn a_component_calls_a_server_on_fast_dds() {
    let Some(program) = program("a_component_calls_a_server_on_fast_dds") else {
        return;
    };
    let domain = domain("ros_fast_oracle", 33);
    let _component = domain.start(&[]);
    let mut client = interop_client(&domain, "client");
    let mut oracle = external(&domain, program, &["oracle"]);
    oracle.says("ready");
    Site::until("the component finds the oracle", || {
        domain.slot("Oracle")["peers"] == 1
    });
    let limit = Duration::from_secs(10);
    for (question, answer) in [
        ("where", "1099511627776 at 1.5 -2.5"),
        ("nonsense", "nonsense 9: so it is"),
    ] {
        assert_eq!(client.consult(question, limit).expect("an answer"), answer);
    }
    oracle.says_all(&["told where", "asked nonsense"]);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            oracle.says("asked hold");
            oracle.kill();
        });
        // The killed server sends nothing, and its lease is long. The call ends at its deadline.
        let late = client.consult("hold", Duration::from_secs(1));
        let late = late.expect("an answer");
        assert!(late.contains("no reply from"), "{late}");
    });
}
