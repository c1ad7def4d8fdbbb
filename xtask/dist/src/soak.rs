//! Tests all packages as a user would meet them: lintian has nothing to say, and in a clean Debian
//! they are installed, networks and the commands of the pages run without cargo and without a connection, and
//! nothing stays when they are removed.

use crate::build::{Build, output, run};
use crate::{named, pages, tree};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The release of Debian, which has a Python that the package for Python accepts.
const RELEASE: &str = "bookworm";

/// What is done in the clean system, in which `/packages` has the packages.
const SCRIPT: &str = r"set -eu
export DEBIAN_FRONTEND=noninteractive
dpkg --install /packages/*.deb > /packages/log 2>&1 || { cat /packages/log; exit 1; }
if command -v cargo; then exit 1; fi
mkdir /robot && cd /robot
cp /packages/patrol.ddsl .
sed 's/Deployment patrol/Deployment second/; s/avoider\.cdsl/avoider_python.cdsl/' patrol.ddsl > second.ddsl
sed 's/Deployment patrol/Deployment third/; s/avoider\.cdsl/avoider_cpp.cdsl/' patrol.ddsl > third.ddsl
for network in patrol second third; do
    rcdeploy up --detach $network.ddsl
    timeout 60 rcdeploy echo $network newFullPose --once
    # A newer package under a running network.
    dpkg --install /packages/robocomp-simulator_*.deb > /dev/null
    timeout 60 rcdeploy echo $network newFullPose --once
    rcdeploy restart $network simulator
    rcdeploy down $network
    test -s patrol.svg
    rm patrol.svg
done
rcgen new --help > /dev/null
# With the OpenCV and the Qt of this Debian.
cp /opt/robocomp/components/networks/detect* .
rcdeploy up --detach detect.ddsl
timeout 60 rcdeploy echo detect newObjects --once
rcdeploy down detect
QT_QPA_PLATFORM=offscreen rcdeploy up --detach /opt/robocomp/components/networks/panel.ddsl
rcdeploy down panel
python3 -c 'import robocomp, robocomp.innermodel, robocomp.graph'
PAGES=/robot/pages PATROL=/packages/patrol.ddsl sh /packages/pages
cd / && rm -r /robot /root/.local
dpkg --purge $(dpkg-query --show --showformat '${Package}\n' 'robocomp-*' python3-robocomp 'rc*' | grep -v '^rcs$') > /dev/null
";

/// The programs that the test runs, with their packages.
const PROGRAMS: [(&str, &str); 5] = [
    ("cmake", "cmake g++ qt6-base-dev"),
    ("lintian", "lintian"),
    ("mmdebstrap", "mmdebstrap"),
    ("unshare", "util-linux"),
    ("ip", "iproute2"),
];

/// Reports programs that the test lacks, before anything is built.
pub(crate) fn check() -> Result<(), String> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let is_there =
        |program: &str| std::env::split_paths(&path).any(|folder| folder.join(program).is_file());
    let missing = PROGRAMS.iter().filter(|(program, _)| !is_there(program));
    let missing: Vec<&str> = missing.map(|(_, package)| *package).collect();
    if missing.is_empty() {
        return Ok(());
    }
    let missing = missing.join(" ");
    Err(format!(
        "--soak needs programs that are not in the PATH: `apt install {missing}`"
    ))
}

/// Tests the packages in `out`.
pub(crate) fn run_all(build: &Build, out: &Path) -> Result<(), String> {
    let debs: Vec<PathBuf> = tree::files(out)?
        .into_iter()
        .filter(|file| file.extension().is_some_and(|ending| ending == "deb"))
        .map(|file| out.join(file))
        .collect();
    run(Command::new("lintian")
        .args(["--fail-on", "error,warning", "--tag-display-limit", "0"])
        .args(&debs))?;
    println!("lintian: {} packages, nothing found", debs.len());
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let root = folder.path().join("root");
    let include = format!("--include={}", needed(&debs)?);
    run(Command::new("mmdebstrap")
        .args(["--quiet", "--variant=minbase", &include, RELEASE])
        .arg(&root))?;
    let before = files(&root)?;
    let packages = root.join("packages");
    for deb in &debs {
        tree::copy(deb, &packages.join(deb.file_name().unwrap_or_default()))?;
    }
    let network = "components/networks/patrol.ddsl";
    tree::copy(&build.root.join(network), &packages.join("patrol.ddsl"))?;
    tree::write(&packages.join("script"), SCRIPT.as_bytes())?;
    let pages = pages::script(&build.root)?;
    tree::write(&packages.join("pages"), pages.as_bytes())?;
    // Names of its own for processes, mounts and the network, which has only itself.
    let inside = "mount -t proc proc \"$0/proc\" && mount --rbind /dev \"$0/dev\" && mount -t tmpfs shm \"$0/dev/shm\" \
                  && ip link set lo up && exec chroot \"$0\" /bin/sh /packages/script";
    run(Command::new("unshare")
        .args(["--mount", "--pid", "--fork", "--kill-child", "--net"])
        .args(["sh", "-c", inside])
        .arg(&root)
        .env("HOME", "/root")
        .env(
            "PATH",
            "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin",
        ))?;
    std::fs::remove_dir_all(&packages).map_err(named(&packages))?;
    let after = files(&root)?;
    let left: Vec<String> = after
        .difference(&before)
        .map(|path| path.display().to_string())
        .collect();
    if left.is_empty() {
        println!(
            "a clean Debian: five networks and the commands of the pages ran, and nothing is left"
        );
        Ok(())
    } else {
        Err(format!(
            "after the removal, these files are left: {}",
            left.join(", ")
        ))
    }
}

/// The packages of Debian that the packages depend on, separated by commas.
fn needed(debs: &[PathBuf]) -> Result<String, String> {
    let (mut own, mut needed) = (BTreeSet::new(), BTreeSet::new());
    for deb in debs {
        let field = |name| output(Command::new("dpkg-deb").arg("-f").arg(deb).arg(name));
        own.insert(field("Package")?.trim().to_owned());
        for name in field("Depends")?.split(',') {
            needed.extend(name.split_whitespace().next().map(str::to_owned));
        }
    }
    let foreign: Vec<String> = needed.difference(&own).cloned().collect();
    Ok(foreign.join(","))
}

/// The files of a system, without what its package manager notes.
fn files(root: &Path) -> Result<BTreeSet<PathBuf>, String> {
    let mut all = tree::files(root)?;
    let notes = ["dev", "proc", "var/lib/dpkg", "var/log", "var/cache"];
    all.retain(|file| !notes.iter().any(|place| file.starts_with(place)));
    Ok(all)
}
