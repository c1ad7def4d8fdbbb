//! Components under valgrind and gdb. The network is that of the README, in Rust.

use rc_test_site::site::{PATROL, Site};
use rc_test_support::python::skipped;
use std::fs::File;
use std::os::unix::fs::{FileTypeExt, PermissionsExt};
use std::path::Path;
use std::process::{Child, Command};

/// Says with which options it runs a program, and runs it.
const VALGRIND: &str = "#!/bin/sh\nwhile [ \"${1#--}\" != \"$1\" ]; do echo \"option $1\"; shift; done\n\
                        echo \"runs $1\"\nexec \"$@\"\n";

fn up(site: &Site, path: &Path, args: &[&str]) -> Command {
    let mut up = site.command(Path::new(env!("CARGO_BIN_EXE_rcdeploy")));
    up.args(["up", "--profile", "dev"]).args(args);
    up.arg(site.ddsl()).env("PATH", path);
    up
}

#[test]
fn valgrind_runs_one_component_and_what_cannot_be_debugged_is_refused() {
    crate::built();
    let site = Site::new("valgrind");
    site.write_ddsl(PATROL);
    let folder = site.path("bin");
    std::fs::create_dir(&folder).expect("a folder");
    let refused = |args: &[&str], code: i32, reason: &str| {
        let up = site.run(up(&site, &folder, args));
        assert_eq!(up.code, code, "{up:?}");
        assert!(up.stderr.contains(reason), "{reason}: {up:?}");
    };
    refused(
        &["--debug", "avoider"],
        3,
        "there is no gdbserver in the path, which --debug needs; on Debian and Ubuntu: `apt install gdb gdbserver`",
    );
    refused(
        &["--valgrind", "avoider"],
        3,
        "there is no valgrind in the path, which --valgrind needs; on Debian and Ubuntu: `apt install valgrind`",
    );
    refused(
        &["--valgrind", "avoidr"],
        2,
        "--valgrind: the network has no component `avoidr`; did you mean `avoider`?",
    );
    refused(
        &["--sanitize", "avoider=address"],
        1,
        "--sanitize avoider: it is in rust; a sanitizer needs a component in C++",
    );
    refused(
        &["--sanitize", "avoider=leaks"],
        2,
        "`leaks` is not a sanitizer; there are address, undefined, thread",
    );
    refused(
        &["--debug", "avoider", "--detach"],
        2,
        "the argument '--debug <NAME>' cannot be used with '--detach'",
    );

    let valgrind = folder.join("valgrind");
    std::fs::write(&valgrind, VALGRIND).expect("to write");
    std::fs::set_permissions(&valgrind, PermissionsExt::from_mode(0o755)).expect("to set");
    refused(
        &["--valgrind", "avoider", "--valgrind", "avoider"],
        1,
        "gdb and valgrind cannot run one component together",
    );
    let address = ["--sanitize", "avoider=address"];
    refused(
        &[&address[..], &["--sanitize", "avoider=thread"]].concat(),
        1,
        "--sanitize avoider: a program has one sanitizer",
    );
    refused(
        &[&address[..], &["--valgrind", "avoider"]].concat(),
        1,
        "--sanitize avoider: valgrind cannot run a program with a sanitizer",
    );
    let up = site.run(up(&site, &folder, &["--valgrind", "avoider", "--detach"]));
    assert_eq!(up.code, 0, "{up:?}");
    let log = site.log("avoider");
    let program = Site::executable("avoider");
    assert!(log.contains("option --leak-check=full"), "{log}");
    assert!(
        log.contains(&format!("runs {}", program.display())),
        "{log}"
    );
    assert!(!site.log("simulator").contains("option"));
    assert_eq!(site.rcdeploy(&["down", &site.network], false).code, 0);
    site.assert_nothing_left();
}

/// An `up` with `--debug`, whose output is in a file. Dropping it ends it.
pub(crate) struct Debugged {
    child: Child,
    /// The socket of gdbserver.
    pub(crate) address: String,
}

impl Debugged {
    /// Starts the network, and waits for the printed command of gdb.
    pub(crate) fn up(site: &Site, mut up: Command) -> Self {
        let output = site.path("debugged");
        let file = File::create(&output).expect("a file");
        up.stdout(file.try_clone().expect("a file")).stderr(file);
        let child = up.spawn().expect("rcdeploy");
        let mut debugged = Self {
            child,
            address: String::new(),
        };
        Site::until("the command of gdb", || {
            let said = std::fs::read_to_string(&output).expect("the output");
            let address = said.split_once("target remote ").map(|(_, rest)| rest);
            let address = address.and_then(|rest| Some(rest.split_once('\'')?.0.to_owned()));
            debugged.address = address.unwrap_or_default();
            let ran = debugged.child.try_wait().expect("a child");
            assert!(ran.is_none(), "{said}");
            // The socket is private to the user: no port is open.
            let socket = std::fs::metadata(&debugged.address);
            socket.is_ok_and(|socket| socket.file_type().is_socket())
        });
        debugged
    }

    /// Waits for the end of the network.
    pub(crate) fn end(mut self) -> Option<i32> {
        self.child.wait().expect("to reap").code()
    }
}

impl Drop for Debugged {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The output of gdb after these commands, which begin where gdbserver has started `program`.
pub(crate) fn gdb(address: &str, program: &Path, commands: &[&str]) -> String {
    let mut gdb = Command::new("gdb");
    gdb.args(["-batch", "-nx", "-iex", "set debuginfod enabled off"]);
    gdb.args(["-ex", &format!("target remote {address}")]);
    for command in commands {
        gdb.args(["-ex", command]);
    }
    let output = gdb.arg(program).output().expect("gdb");
    let (out, errors) = (output.stdout, output.stderr);
    format!(
        "{}{}",
        String::from_utf8_lossy(&out),
        String::from_utf8_lossy(&errors)
    )
}

/// Whether gdb and gdbserver are there. Otherwise `test` is listed as skipped.
pub(crate) fn has_gdb(test: &str) -> bool {
    let runs = |program: &str| {
        let output = Command::new(program).arg("--version").output();
        output.is_ok_and(|output| output.status.success())
    };
    let both = runs("gdb") && runs("gdbserver");
    if !both {
        skipped(test, "there is no gdb or no gdbserver in the path");
    }
    both
}
