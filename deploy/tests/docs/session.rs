//! A shell that runs the commands of the pages one after another, as a reader would.

use crate::markdown::ROOT;
use std::fs;
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::time::{Duration, Instant};

/// The longest time of one command; the first one compiles a component.
const LIMIT: Duration = Duration::from_mins(15);

/// A command that runs until Ctrl-C.
struct Running {
    command: String,
    number: usize,
}

/// One bash with a home folder of its own. The programs of this test run are on its path.
pub(crate) struct Session {
    folder: tempfile::TempDir,
    bash: Child,
    input: Option<ChildStdin>,
    commands: usize,
    running: Vec<Running>,
}

fn target() -> &'static Path {
    let programs = Path::new(env!("CARGO_BIN_EXE_rcdeploy")).parent();
    programs.expect("the target folder")
}

/// `rcdeploy` with the programs of the dev profile, which the test run has built.
const RCDEPLOY: &str = r#"#!/bin/bash
case "$1" in
    check|plan|graph|up|export) command=$1; shift; exec "$PROGRAMS/rcdeploy" "$command" --profile dev "$@" ;;
    *) exec "$PROGRAMS/rcdeploy" "$@" ;;
esac
"#;

/// cargo, which builds in the dev profile and selects all of a workspace, as this test run does.
/// In the folder of this project, `cargo run` starts a program that is built.
const CARGO_SCRIPT: &str = r#"#!/bin/bash
case "$1 $*" in
    "run "*|*" --release "*) action=$1; shift ;;
    *) exec "$CARGO" "$@" ;;
esac
program= options=()
while [ $# -gt 0 ]; do
    case "$1" in
        --) shift; break ;;
        -p|--bin) program=$2; shift 2 ;;
        --release) shift ;;
        *) options+=("$1"); shift ;;
    esac
done
case "$action $program" in
    "run rcdeploy") exec rcdeploy "$@" ;;
    run*) ;;
    build*) exec "$CARGO" build --workspace --bin "$program" "${options[@]}" ;;
    *) exec "$CARGO" "$action" --workspace "${options[@]}" -- "$@" ;;
esac
if [ "$(pwd -P)" != "$PROJECT" ]; then
    "$CARGO" build -q --workspace --bin "$program" || exit
fi
exec "$PROGRAMS/$program" "$@"
"#;

fn programs(folder: &Path) {
    fs::create_dir(folder).expect("a folder");
    let scripts = [
        ("rcgen", "#!/bin/bash\nexec \"$PROGRAMS/rcgen\" \"$@\"\n"),
        ("rcview", "#!/bin/bash\nexec \"$PROGRAMS/rcview\" \"$@\"\n"),
        ("rcdeploy", RCDEPLOY),
        ("cargo", CARGO_SCRIPT),
    ];
    for (name, text) in scripts {
        let path = folder.join(name);
        fs::write(&path, text).expect("a script");
        fs::set_permissions(&path, fs::Permissions::from_mode(0o755)).expect("a script");
    }
}

impl Session {
    /// Begins in the folder of this project.
    pub(crate) fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        for name in ["home", "run", "out"] {
            fs::create_dir(path(name)).expect("a folder");
        }
        programs(&path("bin"));
        let search = std::env::var("PATH").unwrap_or_default();
        let home = std::env::var("HOME").unwrap_or_default();
        let of_cargo = |variable: &str, default: &str| {
            let kept = std::env::var(variable).ok();
            kept.unwrap_or_else(|| format!("{home}/{default}"))
        };
        let mut bash = Command::new("bash")
            .args(["--norc", "--noprofile"])
            .current_dir(ROOT)
            .env("PROGRAMS", target())
            .env("PROJECT", Path::new(ROOT).canonicalize().expect("a folder"))
            .env("CARGO", env!("CARGO"))
            .env("PATH", format!("{}:{search}", path("bin").display()))
            .env("HOME", path("home"))
            .env("CARGO_HOME", of_cargo("CARGO_HOME", ".cargo"))
            .env("RUSTUP_HOME", of_cargo("RUSTUP_HOME", ".rustup"))
            .env("CARGO_NET_OFFLINE", "true")
            .env("CARGO_TARGET_DIR", target().parent().expect("a folder"))
            // A domain for this test alone, of those whose ports are free for DDS.
            .env("ROS_DOMAIN_ID", (1 + std::process::id() % 100).to_string())
            .env("XDG_RUNTIME_DIR", path("run"))
            .env("XDG_STATE_HOME", path("state"))
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("bash");
        let input = bash.stdin.take();
        let mut session = Self {
            folder,
            bash,
            input,
            commands: 0,
            running: Vec::new(),
        };
        session.write("set -m\n");
        session
    }

    pub(crate) fn home(&self) -> PathBuf {
        self.folder.path().join("home")
    }

    fn write(&mut self, text: &str) {
        let input = self.input.as_mut().expect("the input of bash");
        input.write_all(text.as_bytes()).expect("bash reads");
    }

    fn file(&self, number: usize, ending: &str) -> PathBuf {
        self.folder.path().join(format!("out/{number}.{ending}"))
    }

    fn read(&self, number: usize, ending: &str) -> String {
        fs::read(self.file(number, ending))
            .map(|bytes| String::from_utf8_lossy(&bytes).into_owned())
            .unwrap_or_default()
    }

    fn until(&self, what: &str, number: usize, condition: impl Fn() -> bool) -> Result<(), String> {
        let start = Instant::now();
        while !condition() {
            if start.elapsed() > LIMIT {
                return Err(format!("{what}:\n{}", self.read(number, "out")));
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        Ok(())
    }

    /// Exit code and output of a command that ends. It may change folder and environment of the
    /// commands after it.
    pub(crate) fn run(&mut self, command: &str) -> Result<(i32, String), String> {
        let number = self.next();
        let (out, code) = (self.file(number, "out"), self.file(number, "code"));
        self.write(&format!(
            "{{ {command}\n}} > {out} 2>&1 < /dev/null; echo $? > {code}.part; mv {code}.part {code}\n",
            out = out.display(),
            code = code.display()
        ));
        self.until("it does not end", number, || code.exists())?;
        let code = self.read(number, "code").trim().parse();
        Ok((code.expect("an exit code"), self.read(number, "out")))
    }

    fn next(&mut self) -> usize {
        self.commands += 1;
        self.commands
    }

    /// Starts a command that runs until Ctrl-C, and waits until it prints `text`.
    pub(crate) fn start(&mut self, command: &str, text: &str) -> Result<String, String> {
        let number = self.next();
        let (out, code) = (self.file(number, "out"), self.file(number, "code"));
        let pid = self.file(number, "pid");
        self.write(&format!(
            "{{ {command}\n echo $? > {code}.part; mv {code}.part {code}\n}} > {out} 2>&1 < /dev/null & echo $! > {pid}\n",
            out = out.display(),
            code = code.display(),
            pid = pid.display()
        ));
        self.running.push(Running {
            command: command.to_owned(),
            number,
        });
        let printed = || self.read(number, "out").contains(text);
        self.until(&format!("it does not print `{text}`"), number, || {
            printed() || code.exists()
        })?;
        let output = self.read(number, "out");
        if printed() {
            Ok(output)
        } else {
            self.running.pop();
            Err(format!("it ended without `{text}`:\n{output}"))
        }
    }

    /// Presses Ctrl-C in the terminal of the command that was started last, which must still run.
    pub(crate) fn interrupt(&mut self) -> Result<(), String> {
        let Running { command, number } = self.running.pop().ok_or("nothing runs")?;
        if self.file(number, "code").exists() {
            let (code, output) = (self.read(number, "code"), self.read(number, "out"));
            let code = code.trim();
            return Err(format!(
                "`{command}` has ended by itself with {code}:\n{output}"
            ));
        }
        let pid = self.read(number, "pid");
        self.write(&format!("kill -INT -- -{}\n", pid.trim()));
        let ended = self.file(number, "code");
        self.until("it does not end by Ctrl-C", number, || ended.exists())?;
        let code = self.read(number, "code");
        if code.trim() == "0" {
            return Ok(());
        }
        let output = self.read(number, "out");
        Err(format!("`{command}` ends with {}:\n{output}", code.trim()))
    }

    pub(crate) fn anything_runs(&self) -> bool {
        !self.running.is_empty()
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        while !self.running.is_empty() {
            let _ = self.interrupt();
        }
        self.input = None;
        let _ = self.bash.wait();
    }
}
