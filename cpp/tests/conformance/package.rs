//! The components of the tests in C++.

use rc_codegen::{FileLoader, Project};
use rc_diagnostics::{Diagnostics, SourceMap};
use rc_other_end::{Over, Package};
use rc_test_support::cmake;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, PoisonError};

/// The folder of the components.
const COMPONENTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests");

/// The runtime keeps descriptions for ever, which would be leaks.
const WITHOUT_LEAKS: &str = "detect_leaks=0";

/// Held by the test that builds. The programs for all middlewares have the same worker and the same
/// interfaces, which the first build compiles.
static BUILD: Mutex<()> = Mutex::new(());

/// The sanitizers under which components run, as `-fsanitize` takes them (`RC_CPP_SANITIZE`).
pub(crate) fn sanitizer() -> Option<String> {
    std::env::var("RC_CPP_SANITIZE").ok()
}

/// Where a program is built, in a path with a space. `compiler` is empty for the one that cmake finds.
fn folder(name: &str, compiler: &str) -> PathBuf {
    let mut name = name.replace('_', " ");
    if !compiler.is_empty() {
        name = format!("{name} {compiler}");
    }
    name.extend(sanitizer().map(|of| format!(" {}", of.replace(',', " "))));
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// Generates and builds a component. `None` without cmake or a compiler: the test is listed as
/// skipped.
pub(crate) fn package(name: &str, over: Over) -> Option<Package> {
    package_by("", name, over)
}

/// Generates and builds a component with a compiler.
pub(crate) fn package_by(compiler: &str, name: &str, over: Over) -> Option<Package> {
    let test = format!("{name} in C++ over {}", over.name());
    let cmake = cmake::folder(&test)?;
    let _build = BUILD.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = folder(name, compiler);
    generate(name, over, &folder);
    let run = |args: &[&std::ffi::OsStr]| {
        let mut command = Command::new(cmake.join("cmake"));
        if !compiler.is_empty() {
            command.env("CXX", compiler);
        }
        let output = command.args(args).output().expect("cmake");
        let text = String::from_utf8_lossy(&output.stdout);
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{text}{errors}");
    };
    let set = |name: &str, value: &Path| {
        let mut option = std::ffi::OsString::from(format!("-D{name}="));
        option.push(value);
        option
    };
    let build = folder.join("build");
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("cmake");
    let flags = "-Wall -Wextra -Wpedantic -Werror";
    run(&[
        "-S".as_ref(),
        folder.as_os_str(),
        "-B".as_ref(),
        build.as_os_str(),
        &set("robocomp_DIR", &config),
        &set("ROBOCOMP_LIBRARY", &native()),
        &set("CMAKE_CXX_FLAGS", Path::new(flags)),
        &set(
            "ROBOCOMP_SANITIZER",
            Path::new(&sanitizer().unwrap_or_default()),
        ),
        &set("ROBOCOMP_TESTS", Path::new("ON")),
    ]);
    // The linker must not write into a program that runs, which is the same file.
    let linked = build.join(name);
    let _ = std::fs::remove_file(&linked);
    // Not its test, which `ctest` builds for one middleware.
    run(&[
        "--build".as_ref(),
        build.as_os_str(),
        "--target".as_ref(),
        name.as_ref(),
    ]);
    let source = folder.join("generated/description.cpp");
    let source = std::fs::read_to_string(source).expect("a source");
    let description = source.split("R\"rc_json(").nth(1).expect("a description");
    let description = description.split(")rc_json\"").next().expect("its end");
    let mut description: Value = serde_json::from_str(description).expect("JSON");
    let program = build.join(format!("{name}_{}", over.name()));
    // An earlier test may still run it.
    let _ = std::fs::remove_file(&program);
    // A copy could not be started while another thread starts a program: its child has the file open.
    std::fs::hard_link(&linked, &program).expect("a link");
    // The program names the library of this build; cargo's folders may have an older one.
    let mut command = Command::new(program);
    command.env_remove("LD_LIBRARY_PATH");
    command.env("ASAN_OPTIONS", WITHOUT_LEAKS);
    Some(Package {
        command,
        slots: description["slots"].take(),
        folder: None,
    })
}

/// Writes a component of the tests, generated for a middleware.
fn generate(name: &str, over: Over, folder: &Path) {
    let (mut sources, loader) = (SourceMap::new(), FileLoader::new(&[]));
    let cdsl = Path::new(COMPONENTS)
        .join(name)
        .join(format!("{name}.cdsl"));
    let right = |found: Diagnostics| assert!(!found.has_errors(), "{found:?}");
    let (project, found) = Project::load(&cdsl, &mut sources, &loader).expect("a file");
    right(found);
    let project = project.expect("a component");
    let (files, found) =
        rc_codegen::generate::component(&project, over.backend, "").expect("templates");
    right(found);
    files.write(folder).expect("to write");
    // The folder may be that of an earlier release.
    let cmake_lists = Path::new("CMakeLists.txt");
    let text = files.text(cmake_lists).expect("a file");
    renew(text.as_bytes(), &folder.join(cmake_lists));
    for part in ["src", "tests"] {
        let own = Path::new(COMPONENTS).join(name).join(part);
        for file in std::fs::read_dir(own).into_iter().flatten() {
            let file = file.expect("a file");
            let text = std::fs::read(file.path()).expect("a file");
            renew(&text, &folder.join(part).join(file.file_name()));
        }
    }
}

/// The compiler of C++ checks the sources of a component, the headers and its test with strict flags, and writes
/// nothing.
pub(crate) fn check(compiler: &str, flags: &[&str], name: &str) {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    generate(name, Over::iceoryx2(), folder);
    let headers = Path::new(env!("CARGO_MANIFEST_DIR")).join("include");
    let mut check = Command::new(compiler);
    check.args(["-fsyntax-only", "-Werror"]).args(flags);
    for headers in [&headers, &folder.join("generated"), &folder.join("src")] {
        check.arg("-I").arg(headers);
    }
    check.arg("-DROBOCOMP_COMPONENT_FOLDER=\"\"");
    for source in [
        "generated/main.cpp",
        "generated/component.cpp",
        "generated/description.cpp",
        "src/specificworker.cpp",
        "tests/worker_test.cpp",
    ] {
        check.arg(folder.join(source));
    }
    let checked = check.output().expect("a compiler");
    let said = String::from_utf8_lossy(&checked.stderr);
    assert!(checked.status.success(), "{compiler} {flags:?}: {said}");
}

/// Writes a file if it has another text: cmake goes by the times of files.
fn renew(text: &[u8], to: &Path) {
    if std::fs::read(to).ok().as_deref() != Some(text) {
        std::fs::write(to, text).expect("to write");
    }
}

/// Builds the test of a component that was built, and runs it by ctest.
pub(crate) fn ctest(name: &str) {
    ctest_by("", name);
}

/// The same for one that a compiler has built.
pub(crate) fn ctest_by(compiler: &str, name: &str) {
    let cmake = cmake::folder(name).expect("it was built before");
    let _build = BUILD.lock().unwrap_or_else(PoisonError::into_inner);
    let build = Command::new(cmake.join("cmake"))
        .arg("--build")
        .arg(folder(name, compiler).join("build"))
        .args(["--target", &format!("{name}_worker_test")])
        .output();
    let build = build.expect("cmake");
    assert!(build.status.success(), "{build:?}");
    let run = Command::new(cmake.join("ctest"))
        .arg("--output-on-failure")
        .current_dir(folder(name, compiler).join("build"))
        .env_remove("LD_LIBRARY_PATH")
        .env("ASAN_OPTIONS", WITHOUT_LEAKS)
        .output();
    let run = run.expect("ctest");
    let said = String::from_utf8_lossy(&run.stdout);
    assert!(run.status.success(), "{said}");
    assert!(said.contains("100% tests passed"), "{said}");
}

pub(crate) fn native() -> PathBuf {
    let own = std::env::current_exe().expect("this program");
    own.with_file_name("librobocomp_cpp.so")
}
