//! Writes a package of Debian: `dpkg-deb` packs a folder that has the files in their places, and
//! `DEBIAN` with the control files.

use crate::build::{Build, Profile, output, run};
use crate::packages::{Architecture, LICENCES, Package};
use crate::selection::LIBRARY;
use crate::tree::{self, Needs};
use crate::wheel::date;
use crate::{hex, named};
use md5::{Digest, Md5};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The findings of lintian that packages have on purpose, each with its reason.
const OVERRIDDEN: [(&str, &str); 3] = [
    (
        "dir-or-file-in-opt",
        "the project has its own prefix, beside workspaces",
    ),
    (
        "embedded-library libyaml *",
        "its translation into Rust, which is linked as all crates are",
    ),
    (
        "custom-library-search-path *",
        "programs in C++ take the library of the prefix, wherever that is",
    ),
];

/// The architecture of this machine in the words of Debian.
fn architecture() -> &'static str {
    match std::env::consts::ARCH {
        "x86_64" => "amd64",
        "aarch64" => "arm64",
        "arm" => "armhf",
        "riscv64" => "riscv64",
        other => other,
    }
}

/// Writes a package into the folder `out`, and returns its path. Its tree gets the files that each
/// package has.
pub(crate) fn write(
    package: &Package,
    build: &Build,
    maintainer: &str,
    out: &Path,
) -> Result<PathBuf, String> {
    let architecture = match package.architecture {
        Architecture::Any => architecture(),
        Architecture::All => "all",
    };
    add_documents(package, build, maintainer)?;
    let files = tree::files(&package.tree)?;
    let (mut bytes, mut needs) = (0, Needs::default());
    let mut sums = String::new();
    for file in &files {
        let path = package.tree.join(file);
        if path.is_symlink() {
            continue;
        }
        if tree::is_elf(&path) {
            needs.add(&path)?;
        }
        let content = std::fs::read(&path).map_err(named(&path))?;
        bytes += content.len();
        let _ = writeln!(sums, "{}  {}", hex(&Md5::digest(&content)), file.display());
    }
    let mut depends = package.depends.clone();
    depends.extend(system_packages(&needs, &package.name)?);
    depends.sort();
    depends.dedup();
    let mut control = format!(
        "Package: {}\nVersion: {}\nArchitecture: {architecture}\nMaintainer: {maintainer}\nInstalled-Size: {}\n",
        package.name,
        build.version,
        bytes.div_ceil(1024)
    );
    for (field, values) in [("Depends", &depends), ("Recommends", &package.recommends)] {
        if !values.is_empty() {
            let _ = writeln!(control, "{field}: {}", values.join(", "));
        }
    }
    let _ = writeln!(
        control,
        "Section: {}\nPriority: optional\nDescription: {}\n {}",
        package.section,
        package.summary,
        wrapped(&package.description)
    );
    let information = package.tree.join("DEBIAN");
    tree::write(&information.join("control"), control.as_bytes())?;
    tree::write(&information.join("md5sums"), sums.as_bytes())?;
    for (name, script) in &package.scripts {
        let place = information.join(name);
        tree::write(&place, script.as_bytes())?;
        tree::set_mode(&place, true)?;
    }
    folders_are_readable(&package.tree)?;
    let name = format!("{}_{}_{architecture}.deb", package.name, build.version);
    let place = out.join(name);
    let mut dpkg = Command::new("dpkg-deb");
    // One thread: the result does not depend on the machine.
    match build.profile {
        Profile::Release => dpkg.args(["-Zxz", "--threads-max=1"]),
        Profile::Dev => dpkg.args(["-Zgzip", "-z1"]),
    };
    dpkg.args(["--root-owner-group", "--build"]);
    dpkg.arg(&package.tree).arg(&place);
    dpkg.env("SOURCE_DATE_EPOCH", build.time.to_string());
    output(&mut dpkg).map_err(|error| format!("{error} (dpkg-deb is a part of Debian's dpkg)"))?;
    Ok(place)
}

/// Lines of at most 79 characters, each after the first one with a space in front.
fn wrapped(text: &str) -> String {
    let mut lines: Vec<String> = Vec::new();
    for paragraph in text.lines() {
        let mut line = String::new();
        for word in paragraph.split(' ') {
            if !line.is_empty() && line.chars().count() + word.chars().count() > 77 {
                lines.push(std::mem::take(&mut line));
            }
            if !line.is_empty() {
                line.push(' ');
            }
            line += word;
        }
        lines.push(line);
    }
    lines.join("\n ")
}

/// The packages with the libraries that programs need.
fn system_packages(needs: &Needs, package: &str) -> Result<Vec<String>, String> {
    let mut all = Vec::new();
    if needs.glibc > 0 {
        all.push(format!("libc6 (>= 2.{})", needs.glibc));
    }
    for library in &needs.libraries {
        match library.as_str() {
            "libgcc_s.so.1" => all.push("libgcc-s1 (>= 4.2)".to_owned()),
            // It is named by the package of the component.
            other if other == LIBRARY.2 => {}
            other => all.push(
                owner(other)
                    .ok_or_else(|| format!("{package}: no package of this machine has {other}"))?,
            ),
        }
    }
    Ok(all)
}

/// The package of this machine that has a library.
fn owner(library: &str) -> Option<String> {
    let mut search = Command::new("dpkg-query");
    search.args(["--search", &format!("*/{library}")]);
    let found = output(&mut search).ok()?;
    // `libstdc++6:amd64: /usr/lib/x86_64-linux-gnu/libstdc++.so.6`. Packages of a cross compiler have it for
    // another processor.
    let own = format!(":{}: ", architecture());
    let mut names = found.lines().filter_map(|line| line.split_once(&own));
    names.next().map(|(name, _)| name.to_owned())
}

/// Copyright, changes, and the findings of lintian that are accepted.
fn add_documents(package: &Package, build: &Build, maintainer: &str) -> Result<(), String> {
    let name = &package.name;
    let folder = package.tree.join("usr/share/doc").join(name);
    let mut copyright =
        "Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/\n\nFiles: *\n\
         Copyright: 2026 the contributors\nLicense: Expat or Apache-2.0\n\nLicense: Expat\n"
            .to_owned();
    let licence = build.root.join(LICENCES[0]);
    let licence = std::fs::read_to_string(&licence).map_err(named(&licence))?;
    for line in licence
        .lines()
        .skip_while(|line| !line.starts_with("Permission"))
    {
        let _ = writeln!(copyright, " {}", if line.is_empty() { "." } else { line });
    }
    copyright += "\nLicense: Apache-2.0\n On Debian systems, /usr/share/common-licenses/Apache-2.0 has its text.\n";
    tree::write(&folder.join("copyright"), copyright.as_bytes())?;
    let changes = format!(
        "{name} ({}) unstable; urgency=medium\n\n  * CHANGELOG.md of the project lists the changes.\n\n -- {maintainer}  {}\n",
        build.version,
        rfc_2822(build.time)
    );
    packed(&folder.join("changelog"), changes.as_bytes())?;
    let has_opt = package.tree.join("opt").exists();
    let tags = OVERRIDDEN.iter().filter(|_| has_opt);
    let tags: String = tags
        .map(|(tag, reason)| format!("# {reason}\n{name}: {tag}\n"))
        .collect();
    if !tags.is_empty() {
        let place = package.tree.join("usr/share/lintian/overrides").join(name);
        tree::write(&place, tags.as_bytes())?;
    }
    Ok(())
}

/// Writes a file that gzip packs, without name and time: `PATH.gz`.
pub(crate) fn packed(path: &Path, text: &[u8]) -> Result<(), String> {
    tree::write(path, text)?;
    run(Command::new("gzip").args(["-9n", "-f"]).arg(path))?;
    let packed = format!("{}.gz", path.display());
    tree::set_mode(Path::new(&packed), false)
}

/// A time as changelogs of Debian have it, in UTC.
fn rfc_2822(seconds: u64) -> String {
    let (days, rest) = (seconds / 86_400, seconds % 86_400);
    let (year, month, day) = date(days);
    // 1970 began on a Thursday.
    let weekday = ["Thu", "Fri", "Sat", "Sun", "Mon", "Tue", "Wed"][(days % 7) as usize];
    let months = [
        "Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec",
    ];
    let month = months[(month - 1) as usize];
    let (hour, minute, second) = (rest / 3600, rest / 60 % 60, rest % 60);
    format!("{weekday}, {day:02} {month} {year} {hour:02}:{minute:02}:{second:02} +0000")
}

/// Folders get the mode that they have in packages, whatever the mask of the user is.
fn folders_are_readable(folder: &Path) -> Result<(), String> {
    tree::set_mode(folder, true)?;
    for entry in folder.read_dir().map_err(named(folder))? {
        let entry = entry.map_err(named(folder))?;
        if entry.file_type().map_err(named(&entry.path()))?.is_dir() {
            folders_are_readable(&entry.path())?;
        }
    }
    Ok(())
}
