//! Runs `ssh`: its arguments, its script on the other machine, and the meaning of its errors.

use crate::process::identity::{MARK, Mark};
use rc_deploy_network::plan::Host;
use std::fs::File;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};

/// The environment variable with a command in place of `ssh`, and with its first arguments,
/// separated by blanks.
const COMMAND: &str = "RC_SSH";

/// The prefix of the names of copies of rcdeploy. The hash of the program follows.
pub(crate) const COPY: &str = "rcdeploy-";

/// The prefix of the lines that the script prints. Other lines come from the login and are ignored.
pub(crate) const TOKEN: &str = "rcdeploy agent:";

/// The complaint of the script where no folder takes programs.
const NO_PROGRAMS: &str = "no program may run in the folders";

/// Uses the user's keys and settings, never asks for a password, and ends a dead connection.
const OPTIONS: [&str; 9] = [
    "BatchMode=yes",
    "ConnectTimeout=5",
    "ServerAliveInterval=2",
    "ServerAliveCountMax=2",
    "ClearAllForwardings=yes",
    "ForwardAgent=no",
    // A separate connection, so that no other ssh ends it.
    "ControlMaster=no",
    "ControlPath=none",
    "LogLevel=ERROR",
];

/// Starts ssh, which runs `script` there. The returned socket is its standard input and output; its
/// errors go to `log`. Ctrl-C of the terminal does not reach it. It carries the mark of the
/// network.
pub(crate) fn start(
    host: &Host,
    script: &str,
    log: File,
    mark: &Mark,
) -> Result<(Child, UnixStream), String> {
    let given = std::env::var(COMMAND).unwrap_or_default();
    let mut words = given.split_ascii_whitespace();
    let program = words.next().unwrap_or("ssh");
    let failed = |error: io::Error| {
        match error.kind() {
        io::ErrorKind::NotFound if given.is_empty() => {
            "there is no program `ssh` here; install it (on Debian and Ubuntu: apt install openssh-client)".to_owned()
        }
        _ => format!("cannot start {program}: {error}"),
    }
    };
    let (stream, theirs) = UnixStream::pair().map_err(failed)?;
    let output = theirs.try_clone().map_err(failed)?;
    let mut command = Command::new(program);
    command.args(words).arg("-T");
    for option in OPTIONS {
        command.args(["-o", option]);
    }
    if let Some(user) = &host.user {
        command.args(["-l", user]);
    }
    let child = command
        .args(["--", &host.address])
        // `sh` reads this, whatever the login shell is. It has no apostrophe and no line end.
        .arg(format!("exec sh -c '{script}'"))
        .env(MARK, mark.value())
        .process_group(0)
        .stdin(Stdio::from(OwnedFd::from(theirs)))
        .stdout(Stdio::from(OwnedFd::from(output)))
        .stderr(log)
        .spawn();
    Ok((child.map_err(failed)?, stream))
}

/// The script: it prints the kind of the machine, receives the copy of rcdeploy if there is none
/// with this hash, and becomes its agent.
///
/// A cache folder in which no program may run (`noexec`) is left for one of the folders for
/// temporary files. There, it has to be a folder of the user and no link, which another user may have
/// made and changes later. A file without an interpreter line finds that out: the shell runs it itself
/// unless the system refuses it.
///
/// With `other`, the host has another processor, or builds its programs. An `rcdeploy` of this version that
/// is installed there serves then, too.
pub(crate) fn script(hash: &str, size: u64, other: bool) -> String {
    let choose = choose();
    let version = env!("CARGO_PKG_VERSION");
    let installed = if other {
        format!(
            "if [ $w = wants ]; then i=\"$(command -v rcdeploy)\"; \
             [ \"$i\" ] && [ \"$(\"$i\" --version)\" = \"rcdeploy {version}\" ] && cp \"$i\" \"$n\" && mv \"$n\" \"$f\" && w=has; fi; "
        )
    } else {
        String::new()
    };
    format!(
        "umask 077; {choose}; \
         f=\"$d/{COPY}{hash}\"; n=\"$f.$$\"; \
         [ -x \"$f\" ] || w=wants; {installed}\
         echo; echo \"{TOKEN} $w $(uname -sm)\"; \
         if [ $w = wants ]; then \
         head -c {size} > \"$n\" && [ $(wc -c < \"$n\") -eq {size} ] && chmod 700 \"$n\" && mv \"$n\" \"$f\" || {{ rm -f \"$n\"; exit 1; }}; \
         fi; \
         touch \"$f\"; echo; echo \"{TOKEN} stored\"; exec \"$f\" agent"
    )
}

/// The commands that let `d` be a folder in which programs may run, and `w` be `has`.
pub(super) fn choose() -> String {
    format!(
        "u=\"robocomp-$(id -u)\"; c=\"${{XDG_CACHE_HOME:-$HOME/.cache}}/robocomp\"; \
         for d in \"$c\" \"/var/tmp/$u\" \"/tmp/$u\"; do \
         t=\"$d/.try.$$\"; w=no; \
         mkdir -p \"$d\" && [ -O \"$d\" ] && {{ [ \"$d\" = \"$c\" ] || [ \"$(find \"$d\" -prune -type d -user $(id -u))\" ]; }} && echo exit 0 > \"$t\" && chmod 700 \"$t\" && \"$t\" && w=has; \
         rm -f \"$t\"; [ $w = no ] || break; \
         done 2>/dev/null; \
         [ $w = has ] || {{ echo \"{NO_PROGRAMS}: ${{XDG_CACHE_HOME:-$HOME/.cache}}, /var/tmp, /tmp\" >&2; exit 1; }}"
    )
}

/// The destination as in `ssh DESTINATION`.
pub(crate) fn destination(host: &Host) -> String {
    match &host.user {
        Some(user) => format!("{user}@{}", host.address),
        None => host.address.clone(),
    }
}

/// Explains why there is no agent, and what to do, from the errors of ssh and of the other machine.
pub(crate) fn explain(host: &Host, noticed: &str, complaint: &str) -> String {
    let to = destination(host);
    let complaint = complaint.trim();
    let last = complaint.lines().last().unwrap_or_default();
    let has = |text: &str| complaint.contains(text);
    if has("Permission denied (") || has("Too many authentication failures") {
        return format!(
            "ssh does not let you in at {to}: {last}; give your key to it with `ssh-copy-id {to}` (`ssh-keygen` makes one), \
             and try `ssh {to} true`"
        );
    }
    if has("REMOTE HOST IDENTIFICATION HAS CHANGED") {
        return format!(
            "{to} is not the machine that it was: its host key has changed; if that is right, `ssh-keygen -R {}` forgets the old one",
            host.address
        );
    }
    if has("Host key verification failed") {
        return format!(
            "the host key of {} is not known yet; look at it once with `ssh {to} true`",
            host.address
        );
    }
    if has("Could not resolve hostname") {
        return format!(
            "{last}; `address` has to be a name or an IP address that `ssh {to}` can reach"
        );
    }
    let unreachable = [
        "Connection refused",
        "Connection timed out",
        "No route to host",
        "Network is unreachable",
        "banner exchange",
    ];
    if unreachable.into_iter().any(has) {
        return format!(
            "{last}; is the machine on, does its sshd run, and is the address right? Try `ssh {to} true`"
        );
    }
    if has(NO_PROGRAMS) {
        return format!(
            "{last} (full, not writable, or mounted `noexec`); set XDG_CACHE_HOME there to a folder that takes programs"
        );
    }
    if has("GLIBC_") {
        return format!(
            "its C library is older than the one that rcdeploy was built for ({last}); build on a machine like it"
        );
    }
    match (complaint.is_empty(), noticed.is_empty()) {
        (true, _) => noticed.to_owned(),
        (false, true) => complaint.to_owned(),
        (false, false) => format!("{noticed}: {complaint}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_script_passes_through_any_shell() {
        let script = script("abc", 7, true);
        assert!(!script.contains(['\'', '\n', '!']), "{script}");
        assert!(script.contains("/rcdeploy-abc\"; "), "{script}");
    }

    /// The output of the script where these folders take no programs, and the file that became the
    /// agent. `None` if the system lets no test mount.
    fn run(noexec: &[&str], more: &str) -> Option<(String, String)> {
        use std::io::Write;
        let home = tempfile::tempdir().expect("a folder");
        let mut mounts = String::from("mkdir -p .cache && mount -t tmpfs none /var/tmp");
        for folder in noexec {
            mounts.push_str(&format!(" && mount -t tmpfs -o noexec none {folder}"));
        }
        mounts.push_str(more);
        let program = "echo \"I am $0\"\n";
        let script = script("abc", program.len() as u64, false);
        let unshare = |words: &[&str]| {
            let mut command = Command::new("unshare");
            command.args(["--user", "--map-root-user", "--mount", "sh", "-c"]);
            command.args(words).current_dir(home.path());
            command
                .env("HOME", home.path())
                .env_remove("XDG_CACHE_HOME");
            command
                .stdin(Stdio::piped())
                .stdout(Stdio::piped())
                .stderr(Stdio::piped());
            command
        };
        let probe = unshare(&[&mounts]).output();
        probe.ok().filter(|output| output.status.success())?;
        let whole = format!("{mounts} && exec sh -c \"$0\"");
        let mut child = unshare(&[&whole, &script]).spawn().expect("a shell");
        let mut input = child.stdin.take().expect("its input");
        // The script may have refused.
        let _ = input.write_all(program.as_bytes());
        drop(input);
        let output = child.wait_with_output().expect("its output");
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("a text");
        Some((text(output.stdout), text(output.stderr)))
    }

    #[test]
    fn a_cache_without_programs_is_left_for_another_folder() {
        let Some((out, _)) = run(&[], "") else {
            println!(
                "skipped: a_cache_without_programs_is_left_for_another_folder: no test may mount"
            );
            return;
        };
        assert!(out.contains(&format!("{TOKEN} wants Linux ")), "{out}");
        assert!(out.contains("/.cache/robocomp/rcdeploy-abc"), "{out}");
        let (out, err) = run(&[".cache"], "").expect("it could mount before");
        assert!(
            out.contains("I am /var/tmp/robocomp-0/rcdeploy-abc"),
            "{out}{err}"
        );
        let link = " && mkdir /var/tmp/own && ln -s own /var/tmp/robocomp-0";
        let (out, err) = run(&["/tmp", ".cache"], link).expect("it could mount before");
        assert_eq!(out, "", "{err}");
        let (out, err) = run(&["/tmp", "/var/tmp", ".cache"], "").expect("it could mount before");
        assert_eq!(out, "", "{err}");
        let host = Host {
            name: "robot".to_owned(),
            address: "10.0.0.2".to_owned(),
            user: None,
            workspace: None,
            elsewhere: None,
        };
        let told = explain(&host, "it ended", &err);
        assert!(told.contains("/.cache, /var/tmp, /tmp (full,"), "{told}");
    }

    #[test]
    fn each_error_of_ssh_has_a_remedy() {
        let host = Host {
            name: "robot".to_owned(),
            address: "10.0.0.2".to_owned(),
            user: Some("pi".to_owned()),
            workspace: None,
            elsewhere: None,
        };
        for (complaint, advice) in [
            (
                "pi@10.0.0.2: Permission denied (publickey).",
                "`ssh-copy-id pi@10.0.0.2`",
            ),
            ("Host key verification failed.", "`ssh pi@10.0.0.2 true`"),
            (
                "ssh: Could not resolve hostname robot: Name or service not known",
                "`address`",
            ),
            (
                "ssh: connect to host 10.0.0.2 port 22: Connection refused",
                "does its sshd run",
            ),
        ] {
            let error = explain(&host, "the connection ended", complaint);
            assert!(error.contains(advice), "{error}");
        }
        let error = explain(&host, "it ended", "sh: head: not found\n");
        assert_eq!(error, "it ended: sh: head: not found");
    }
}
