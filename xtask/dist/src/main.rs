//! `cargo xtask dist`: packages for Debian, a wheel for Python, the library crates, checksums and a
//! bill of materials, from one build. Two runs on the same commit write the same bytes.
//!
//! [`build`] runs cargo and cmake, [`selection`] says which packages there are, [`packages`] what
//! belongs into which one, [`deb`] and [`wheel`] write the formats, [`crates`] what crates.io gets, [`sbom`] the
//! bill of materials, [`second`] compares two compilations, [`soak`] tests the packages in a clean system,
//! where it runs the commands of [`pages`]. [`book`] writes the documentation.

mod book;
mod build;
mod crates;
mod deb;
mod packages;
mod pages;
mod sbom;
mod second;
mod selection;
mod soak;
mod tree;
mod wheel;

use build::Build;
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const USAGE: &str = "\
Writes packages into a folder: .deb files, a wheel of Python, library crates, SHA256SUMS and a bill of
materials.

usage: cargo xtask dist [OPTIONS]

  --out DIR            the folder (target/dist), whose packages of RoboComp are replaced
  --profile NAME       release, or dev: for tests, without the care for equal bytes on all machines
  --built              takes the programs that are built, and runs no cargo
  --only NAME          one package of Debian, `wheel` or `crates`; may be given several times
  --check              then compiles a second time, from a copy of the sources in another folder, and
                       compares the packages; builds each library crate from its package, as crates.io
                       would get it
  --maintainer TEXT    `Name <mail>` in the packages of Debian ($DEBFULLNAME <$DEBEMAIL>, else the
                       author of the last commit)
  --soak               then tests the packages: with lintian, and in a clean Debian (needs root)

usage: cargo xtask dist --pages
  Prints the commands of the documentation that --soak runs.
";

/// The command line.
struct Arguments {
    out: Option<PathBuf>,
    profile: build::Profile,
    built: bool,
    only: Vec<String>,
    maintainer: Option<String>,
    check: bool,
    soak: bool,
}

impl Arguments {
    fn parse(mut words: impl Iterator<Item = String>) -> Result<Option<Self>, String> {
        let mut arguments = Self {
            out: None,
            profile: build::Profile::Release,
            built: false,
            only: Vec::new(),
            maintainer: None,
            check: false,
            soak: false,
        };
        while let Some(word) = words.next() {
            let mut value = || words.next().ok_or(format!("{word} needs a value"));
            match word.as_str() {
                "--out" => arguments.out = Some(value()?.into()),
                "--profile" => {
                    arguments.profile = match value()?.as_str() {
                        "release" => build::Profile::Release,
                        "dev" => build::Profile::Dev,
                        other => return Err(format!("`{other}` is not release or dev")),
                    }
                }
                "--built" => arguments.built = true,
                "--only" => arguments.only.push(value()?),
                "--maintainer" => arguments.maintainer = Some(value()?),
                "--check" => arguments.check = true,
                "--soak" => arguments.soak = true,
                "--help" | "-h" => return Ok(None),
                other => return Err(format!("unknown option `{other}`; see --help")),
            }
        }
        Ok(Some(arguments))
    }
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if let Some(("book", rest)) = words.split_first().map(|(first, rest)| (&**first, rest)) {
        return ended("book", book::run_command(rest));
    }
    if words == ["--pages"] {
        return ended("dist", pages::print());
    }
    let arguments = match Arguments::parse(words.into_iter()) {
        Ok(Some(arguments)) => arguments,
        Ok(None) => {
            print!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        Err(message) => {
            eprintln!("dist: error: {message}");
            return ExitCode::from(2);
        }
    };
    ended("dist", write(&arguments))
}

/// The exit code of a command, after it has said why it failed.
fn ended(command: &str, outcome: Result<(), String>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{command}: error: {message}");
            ExitCode::from(3)
        }
    }
}

fn write(arguments: &Arguments) -> Result<(), String> {
    let build = Build::new(arguments.profile, arguments.built)?;
    let out = match &arguments.out {
        Some(out) => std::path::absolute(out).map_err(|error| error.to_string())?,
        None => build.root.join("target/dist"),
    };
    if arguments.soak {
        if !arguments.only.is_empty() {
            return Err("--soak tests all packages: leave --only out".to_owned());
        }
        soak::check()?;
    }
    let names = selection::selected(&build, &arguments.only)?;
    let compares = arguments.check && names.has_programs();
    if compares && (arguments.built || arguments.profile == build::Profile::Dev) {
        return Err(
            "--check compiles twice, in the profile release: leave out --built and --profile dev"
                .to_owned(),
        );
    }
    let maintainer = match &arguments.maintainer {
        Some(maintainer) => maintainer.clone(),
        None => build.maintainer()?,
    };
    // All packages together have a bill of materials.
    let has_bill = arguments.only.is_empty();
    let pack = |build: &Build, out: &Path| pack(build, &names, &maintainer, has_bill, out);
    if !arguments.built {
        build.run(&names)?;
    }
    std::fs::create_dir_all(&out).map_err(named(&out))?;
    remove_old(&out, selection::is_ours)?;
    let crates = out.join(crates::FOLDER);
    if crates.is_dir() {
        let names = crates::names(&build)?;
        remove_old(&crates, |file| crates::is_ours(file, &names))?;
    }
    let written = pack(&build, &out)?;
    sums(&written, &out)?;
    for path in &written {
        println!("wrote {}", path.display());
    }
    if compares {
        second::compare(&build, &written, &out, |build, out| {
            build.run(&names)?;
            pack(build, out)
        })?;
    }
    if arguments.check && names.crates {
        crates::verify(&build)?;
    }
    if arguments.soak {
        soak::run_all(&build, &out)?;
    }
    Ok(())
}

/// Writes the packages of what is built into a folder, and returns their paths.
fn pack(
    build: &Build,
    names: &selection::Selection,
    maintainer: &str,
    has_bill: bool,
    out: &Path,
) -> Result<Vec<PathBuf>, String> {
    // Next to the packages: a folder for temporary files may be in memory.
    let stage = tempfile::Builder::new().prefix(".stage-").tempdir_in(out);
    let stage = stage.map_err(named(out))?;
    let mut written = Vec::new();
    // `rcgen venv` finds the wheel in a package of Debian.
    let wheel = if names.wheel || names.python {
        Some(wheel::write(build, stage.path())?)
    } else {
        None
    };
    for package in &packages::all(build, names, wheel.as_deref(), stage.path())? {
        written.push(deb::write(package, build, maintainer, out)?);
    }
    if names.crates {
        written.extend(crates::write(build, stage.path(), out)?);
    }
    if let Some(wheel) = wheel.filter(|_| names.wheel) {
        let place = out.join(wheel.file_name().unwrap_or_default());
        std::fs::rename(&wheel, &place).map_err(named(&place))?;
        written.push(place);
    }
    if has_bill {
        written.push(sbom::write(build, out)?);
    }
    written.sort();
    Ok(written)
}

/// The endings of packages.
const ENDINGS: [&str; 4] = [".deb", ".whl", ".cdx.json", ".crate"];

/// Removes what an earlier run wrote. The folder may have packages of others.
fn remove_old(out: &Path, is_ours: impl Fn(&str) -> bool) -> Result<(), String> {
    for entry in out.read_dir().map_err(named(out))? {
        let path = entry.map_err(named(out))?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let is_package = ENDINGS.iter().any(|ending| name.ends_with(ending));
        if is_package && is_ours(&name) && path.is_file() {
            std::fs::remove_file(&path).map_err(named(&path))?;
        }
    }
    Ok(())
}

/// Writes `SHA256SUMS`, as `sha256sum --check` reads it.
fn sums(files: &[PathBuf], out: &Path) -> Result<(), String> {
    let mut text = String::new();
    for file in files {
        let bytes = std::fs::read(file).map_err(named(file))?;
        let name = file.strip_prefix(out).unwrap_or(file).display();
        let _ = writeln!(text, "{}  {name}", hex(&Sha256::digest(&bytes)));
    }
    let place = out.join("SHA256SUMS");
    std::fs::write(&place, text).map_err(named(&place))
}

/// Bytes in hexadecimal digits.
fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// An error with the path that it is about.
fn named(path: &Path) -> impl Fn(std::io::Error) -> String {
    let path = path.to_path_buf();
    move |error| format!("{}: {error}", path.display())
}
