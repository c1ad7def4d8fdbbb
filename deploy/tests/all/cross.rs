//! Programs that this machine builds for another processor run there: `cargo xtask soak cross`. qemu stands
//! for the processor of a host, in namespaces that make it known to nobody else.

use rc_test_site::site::{Site, rcdeploy};
use rc_test_support::debian::program;
use rc_test_support::python::{installed, skipped};
use std::ffi::OsString;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The packages of the host. Nothing configures them there.
const PACKAGES: &str = "base-files,bash,coreutils,dash,findutils,grep,libc6,libc-bin,procps,python3,python3-numpy,sed,tar";
/// The libraries whose links their configuration would make.
const LINKS: [&str; 2] = ["blas/libblas.so.3", "lapack/liblapack.so.3"];

/// Its processor as Debian and Rust call it, the gcc for it, what links where that is missing, what runs its
/// programs, and how these begin, with a mask (`binfmt_misc` of Linux).
const ARCH: &str = "arm64";
const PLATFORM: &str = "aarch64-unknown-linux-gnu";
const GCC: &str = "aarch64-linux-gnu-gcc";
const ZIG: &str = "cargo-zigbuild==0.22.2\nziglang==0.14.1";
const QEMU: &str = "qemu-aarch64-static";
const MAGIC: &str = r":arm64:M::\x7fELF\x02\x01\x01\x00\x00\x00\x00\x00\x00\x00\x00\x00\x02\x00\xb7\x00:\xff\xff\xff\xff\xff\xff\xff\x00\xff\xff\xff\xff\xff\xff\xff\xff\xfe\xff\xff\xff";

/// Enters the host. The arguments are its folder, qemu, MAGIC, an empty folder, and a command.
const ENTER: &str = r#"root=$1
mount -t binfmt_misc none "$4"
printf '%s' "$3:$2:F" > "$4/register"
mount --rbind /dev "$root/dev"
mount -t tmpfs none "$root/dev/shm"
mount -t proc none "$root/proc"
mount -t tmpfs none "$root/run"
exec chroot "$root" /usr/bin/env -i HOME=/root XDG_RUNTIME_DIR=/run PATH=/usr/bin:/bin sh -c "$5""#;

const UNSHARE: [&str; 6] = [
    "--user",
    "--map-root-user",
    "--mount",
    "--pid",
    "--fork",
    "--kill-child",
];

/// qemu takes its time.
const NETWORK: &str = r#"
Deployment patrol
{
    middleware iceoryx2;
    Host robot { address "robot"; arch arm64; build here; };
    Component simulator { cdsl "../simulator/simulator.cdsl"; host robot; ready 120s; };
    Component avoider { cdsl "../avoider_python/avoider_python.cdsl"; host robot; ready 120s; };
    bind avoider.Laser -> simulator.Laser;
    bind avoider.DifferentialRobot -> simulator.DifferentialRobot;
    bind avoider.BatteryStatus -> simulator.BatteryStatus;
};
"#;

/// Runs a command within ten minutes. The error is its last line.
fn run(program: &str, words: &[&str], folder: &Path) -> Result<String, String> {
    let mut command = Command::new("timeout");
    command.args(["--kill-after=5", "600", program]).args(words);
    let output = command.current_dir(folder).stdin(Stdio::null()).output();
    let output = output.map_err(|error| error.to_string())?;
    let text = |bytes| String::from_utf8_lossy(bytes).trim().to_owned();
    let last = text(&output.stderr).lines().last().map(str::to_owned);
    let failed = || format!("{program}: {}", last.unwrap_or_default());
    output
        .status
        .success()
        .then(|| text(&output.stdout))
        .ok_or_else(failed)
}

/// The host, and the program for `RC_SSH`. The error says why this machine cannot have it.
fn host(site: &Site) -> Result<PathBuf, String> {
    let root = site.path("host");
    let folder = site.path("");
    let mmdebstrap = program("mmdebstrap --no-install-recommends", "mmdebstrap")?;
    let qemu = program("qemu-user-static --no-install-recommends", QEMU)?;
    let arch = format!("--architectures={ARCH}");
    let include = format!("--include={PACKAGES}");
    let debian = ["--quiet", "--variant=extract", &arch, &include, "bookworm"];
    let at = root.display().to_string();
    let mmdebstrap = mmdebstrap.display().to_string();
    run(&mmdebstrap, &[&debian[..], &[&at]].concat(), &folder)?;
    let libraries = root.join("usr/lib/aarch64-linux-gnu");
    for library in LINKS.map(Path::new) {
        let link = libraries.join(library.file_name().expect("a name"));
        std::os::unix::fs::symlink(library, link).expect("a link");
    }
    let formats = site.path("formats");
    fs::create_dir_all(&formats).expect("a folder");
    let script = site.path("enter");
    fs::write(&script, ENTER).expect("written");
    let ssh = format!(
        "#!/bin/sh\nwhile [ \"$1\" != -- ]; do shift; done\nexec unshare {} sh -eu {} {at} {} '{MAGIC}' {} \"$3\"\n",
        UNSHARE.join(" "),
        script.display(),
        qemu.display(),
        formats.display(),
    );
    let program = site.path("ssh");
    fs::write(&program, ssh).expect("written");
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).expect("set");
    let said = run(
        &program.display().to_string(),
        &["--", "robot", "uname -m"],
        &folder,
    )?;
    if said == "aarch64" {
        Ok(program)
    } else {
        Err(format!("the host says that it is {said}"))
    }
}

/// The path of programs, with zig where this machine has no gcc for that processor. `rcdeploy` says what
/// else is missing.
fn path(site: &Site) -> Result<OsString, String> {
    let folder = site.path("");
    // The Rust of Debian has another way to the standard library, and no rustup.
    let _ = run("rustup", &["target", "add", PLATFORM], &folder);
    let own = std::env::var_os("PATH").unwrap_or_default();
    if run(GCC, &["--version"], &folder).is_ok() {
        return Ok(own);
    }
    let python = installed("zig", ZIG)?;
    let folders = python.parent().map(Path::to_path_buf);
    let folders = folders.into_iter().chain(std::env::split_paths(&own));
    std::env::join_paths(folders).map_err(|error| error.to_string())
}

#[test]
fn a_host_of_another_processor_runs_what_is_built_here() {
    let test = "a_host_of_another_processor_runs_what_is_built_here";
    if std::env::var_os("RC_CROSS").is_none() {
        return skipped(test, "`cargo xtask soak cross` runs it");
    }
    let site = Site::new("cross");
    site.write_ddsl(NETWORK);
    let ready = host(&site).and_then(|ssh| Ok((ssh, path(&site)?)));
    let (ssh, path) = match ready {
        Ok(ready) => ready,
        Err(reason) => return skipped(test, &reason),
    };
    let run = |words: &[&str], file: bool| {
        let mut command = site.command(&rcdeploy());
        command.args(words).env("RC_SSH", &ssh).env("PATH", &path);
        if file {
            command.arg(site.ddsl());
        }
        site.run(command)
    };
    let up = run(&["up", "--build", "--detach", "--profile", "dev"], true);
    if up.stderr.contains("error[missing-cross-compiler]") {
        return skipped(test, &up.stderr);
    }
    assert_eq!(up.code, 0, "{up:?}{}", site.log("rcdeploy"));
    for name in ["simulator", "avoider"] {
        site.await_component(name, |one| one["state"] == "running");
    }
    // Samples of a program on the host.
    let echo = run(&["echo", &site.network, "newFullPose", "--once"], false);
    assert_eq!(echo.code, 0, "{echo:?}");
    let down = run(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.await_nothing_left();
}
