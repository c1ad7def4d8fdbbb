//! The wheel `robocomp`: the package with its extension modules, and the tools, for every Python
//! from 3.11 on. A wheel is an archive of zip with a list of its files.

use crate::build::{Build, Profile};
use crate::tree::{self, Needs};
use crate::{named, packages};
use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

/// The crates of extension modules, their libraries, and their places in the package.
pub(crate) const MODULES: [(&str, &str, &str); 3] = [
    ("rc-python", "librobocomp_python.so", "_native.abi3.so"),
    (
        "rc-python-innermodel",
        "librobocomp_innermodel.so",
        "_innermodel.abi3.so",
    ),
    ("rc-python-graph", "librobocomp_graph.so", "_graph.abi3.so"),
];

/// The tools in a wheel.
const TOOLS: [&str; 3] = ["rcgen", "rcdeploy", "rcforward"];

const SUMMARY: &str = "Clients and components of robots in Python, on the RoboComp framework";

/// Copies the package with its modules into a folder.
pub(crate) fn package(build: &Build, folder: &Path) -> Result<(), String> {
    let sources = build.root.join("python/robocomp");
    for file in tree::files(&sources)? {
        let is_source = file.extension().is_some_and(|e| e == "py" || e == "pyi");
        if is_source || file == Path::new("py.typed") {
            tree::copy(&sources.join(&file), &folder.join(&file))?;
            tree::set_mode(&folder.join(&file), false)?;
        }
    }
    for (_, library, module) in MODULES {
        let place = folder.join(module);
        tree::copy_program(&build.programs().join(library), &place)?;
        tree::set_mode(&place, false)?;
    }
    Ok(())
}

/// The description of the package.
pub(crate) fn metadata(build: &Build) -> String {
    format!(
        "Metadata-Version: 2.1\nName: robocomp\nVersion: {}\nSummary: {SUMMARY}\nLicense: MIT OR Apache-2.0\n\
         Classifier: Operating System :: POSIX :: Linux\nClassifier: Programming Language :: Python :: 3\n\
         Classifier: Programming Language :: Rust\nClassifier: Typing :: Typed\n\
         Requires-Python: >=3.11\nRequires-Dist: numpy>=1.26\n",
        build.version
    )
}

/// Writes the wheel into a folder, and returns its path.
pub(crate) fn write(build: &Build, stage: &Path) -> Result<PathBuf, String> {
    let root = stage.join("wheel");
    package(build, &root.join("robocomp"))?;
    let scripts = format!("robocomp-{}.data/scripts", build.version);
    for tool in TOOLS {
        tree::copy_program(
            &build.programs().join(tool),
            &root.join(&scripts).join(tool),
        )?;
    }
    let mut needs = Needs::default();
    for file in tree::files(&root)? {
        if tree::is_elf(&root.join(&file)) {
            needs.add(&root.join(&file))?;
        }
    }
    let machine = std::env::consts::ARCH;
    let tag = format!("cp311-abi3-manylinux_2_{}_{machine}", needs.glibc);
    let information = root.join(format!("robocomp-{}.dist-info", build.version));
    tree::write(&information.join("METADATA"), metadata(build).as_bytes())?;
    let wheel = format!(
        "Wheel-Version: 1.0\nGenerator: cargo xtask dist\nRoot-Is-Purelib: false\nTag: {tag}\n"
    );
    tree::write(&information.join("WHEEL"), wheel.as_bytes())?;
    for licence in packages::LICENCES {
        tree::copy(
            &build.root.join(licence),
            &information.join("licenses").join(licence),
        )?;
    }
    let record = information.join("RECORD");
    let own = record.strip_prefix(&root).unwrap_or(&record).to_path_buf();
    let mut lines = String::new();
    for file in tree::files(&root)? {
        let path = root.join(&file);
        let bytes = std::fs::read(&path).map_err(named(&path))?;
        let hash = URL_SAFE_NO_PAD.encode(Sha256::digest(&bytes));
        let _ = writeln!(lines, "{},sha256={hash},{}", file.display(), bytes.len());
    }
    let _ = writeln!(lines, "{},,", own.display());
    tree::write(&record, lines.as_bytes())?;
    let place = stage.join(format!("robocomp-{}-{tag}.whl", build.version));
    let mut archive = Archive::new(build);
    let files = tree::files(&root)?;
    // The list is read from the end.
    let (last, first): (Vec<_>, Vec<_>) = files.into_iter().partition(|file| {
        file.iter()
            .next()
            .is_some_and(|part| part.to_string_lossy().ends_with(".dist-info"))
    });
    for file in first.iter().chain(&last) {
        archive.add(&root, file)?;
    }
    std::fs::write(&place, archive.finish()?).map_err(named(&place))?;
    std::fs::remove_dir_all(&root).map_err(named(&root))?;
    Ok(place)
}

/// An archive of zip, as APPNOTE.TXT describes it.
struct Archive {
    bytes: Vec<u8>,
    directory: Vec<u8>,
    files: u16,
    /// Time and date of all files, as DOS has them.
    time: [u8; 4],
    level: u8,
}

/// The version of zip that readers need: 2.0, with compression.
const VERSION: u16 = 20;
/// Version 2.0, made on Unix.
const MADE_BY: u16 = (3 << 8) | VERSION;
const DEFLATED: u16 = 8;
/// A regular file, in the upper half of the attributes.
const REGULAR: u32 = 0o100_000;

impl Archive {
    fn new(build: &Build) -> Self {
        Self {
            bytes: Vec::new(),
            directory: Vec::new(),
            files: 0,
            time: dos_time(build.time),
            level: if build.profile == Profile::Dev { 1 } else { 9 },
        }
    }

    fn add(&mut self, root: &Path, file: &Path) -> Result<(), String> {
        let path = root.join(file);
        let content = std::fs::read(&path).map_err(named(&path))?;
        let mode = std::fs::metadata(&path)
            .map_err(named(&path))?
            .permissions()
            .mode();
        let packed = miniz_oxide::deflate::compress_to_vec(&content, self.level);
        let name = file.to_string_lossy();
        let too_large = |_| format!("{name} is too large for a wheel");
        let mut entry = Vec::new();
        for number in [VERSION, 0, DEFLATED] {
            entry.extend(number.to_le_bytes());
        }
        entry.extend(self.time);
        entry.extend(crc32fast::hash(&content).to_le_bytes());
        for size in [packed.len(), content.len()] {
            entry.extend(u32::try_from(size).map_err(too_large)?.to_le_bytes());
        }
        entry.extend(u16::try_from(name.len()).map_err(too_large)?.to_le_bytes());
        entry.extend(0_u16.to_le_bytes());
        let place = u32::try_from(self.bytes.len()).map_err(too_large)?;
        self.bytes.extend(b"PK\x03\x04");
        self.bytes.extend(&entry);
        self.bytes.extend(name.as_bytes());
        self.bytes.extend(packed);
        self.directory.extend(b"PK\x01\x02");
        self.directory.extend(MADE_BY.to_le_bytes());
        self.directory.extend(&entry);
        // No comment, the first disk, binary.
        self.directory.extend([0; 6]);
        let attributes = (REGULAR | (mode & 0o777)) << 16;
        self.directory.extend(attributes.to_le_bytes());
        self.directory.extend(place.to_le_bytes());
        self.directory.extend(name.as_bytes());
        self.files = self
            .files
            .checked_add(1)
            .ok_or("a wheel has too many files")?;
        Ok(())
    }

    fn finish(mut self) -> Result<Vec<u8>, String> {
        let too_large = |_| "the wheel is too large".to_owned();
        let place = u32::try_from(self.bytes.len()).map_err(too_large)?;
        let size = u32::try_from(self.directory.len()).map_err(too_large)?;
        self.bytes.extend(&self.directory);
        self.bytes.extend(b"PK\x05\x06\0\0\0\0");
        self.bytes.extend(self.files.to_le_bytes());
        self.bytes.extend(self.files.to_le_bytes());
        self.bytes.extend(size.to_le_bytes());
        self.bytes.extend(place.to_le_bytes());
        self.bytes.extend([0; 2]);
        Ok(self.bytes)
    }
}

/// Seconds since 1970 as DOS has them: time, then date, from 1980 to 2107.
fn dos_time(seconds: u64) -> [u8; 4] {
    let (days, rest) = (seconds / 86_400, seconds % 86_400);
    let (year, month, day) = date(days);
    let year = year.clamp(1980, 2107) - 1980;
    let time = ((rest / 3600) << 11) | ((rest / 60 % 60) << 5) | (rest % 60 / 2);
    let date = (year << 9) | (month << 5) | day;
    let [a, b] = (time as u16).to_le_bytes();
    let [c, d] = (date as u16).to_le_bytes();
    [a, b, c, d]
}

/// Year, month and day of a number of days since 1970, after Howard Hinnant, `civil_from_days`.
pub(crate) fn date(days: u64) -> (u64, u64, u64) {
    let days = days + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let of_year = day - (365 * year + year / 4 - year / 100);
    let shifted = (5 * of_year + 2) / 153;
    let month = if shifted < 10 {
        shifted + 3
    } else {
        shifted - 9
    };
    let year = year + era * 400 + u64::from(month <= 2);
    (year, month, of_year - (153 * shifted + 2) / 5 + 1)
}
