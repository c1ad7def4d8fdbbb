//! The component `every_type` as a process, and a network in which the test has endpoints of its
//! own.

use crate::LIMIT;
use rc_codegen::{FileLoader, Project, generate};
use rc_diagnostics::{Diagnostics, SourceMap};
use rc_middleware::typed::Operation;
use rc_middleware::{
    Address, Backend, Endpoint, Environment, ExternalType, Qos, RunDirectory, Settings,
    TypeIdentity, WakeEvent,
};
use rc_test_support::cmake;
use serde_json::Value;
use std::fs::File;
use std::io::{Read as _, Seek as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::sync::{Mutex, PoisonError};

/// The component.
const COMPONENT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/every_type");

/// A middleware with a domain.
pub(crate) struct Over {
    pub(crate) backend: rc_cdsl::model::Middleware,
    pub(crate) domain: i64,
    pub(crate) connect: fn(&Environment) -> Box<dyn Backend>,
}

impl Over {
    fn name(&self) -> &'static str {
        self.backend.word()
    }
}

/// The program of the component for one middleware.
pub(crate) struct Package {
    program: PathBuf,
    /// Its slots, as the program hands them over to the runtime.
    slots: Value,
}

/// Held by the test that builds. The programs for all middlewares have the same worker and the same
/// interfaces, which the first build compiles.
static BUILD: Mutex<()> = Mutex::new(());

/// Where the program is built.
fn folder() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("every type")
}

/// Generates and builds the component. `None` without cmake or a compiler: the test is listed as
/// skipped.
pub(crate) fn package(over: &Over) -> Option<Package> {
    let test = format!("conformance of C++ over {}", over.name());
    let cmake = cmake::folder(&test)?;
    let (mut sources, loader) = (SourceMap::new(), FileLoader::new(&[]));
    let cdsl = Path::new(COMPONENT).join("every_type.cdsl");
    let right = |found: Diagnostics| assert!(!found.has_errors(), "{found:?}");
    let (project, found) = Project::load(&cdsl, &mut sources, &loader).expect("a file");
    right(found);
    let project = project.expect("a component");
    let (files, found) = generate::component(&project, over.backend, "").expect("templates");
    right(found);
    let _build = BUILD.lock().unwrap_or_else(PoisonError::into_inner);
    // A path with a space.
    let folder = folder();
    files.write(&folder).expect("to write");
    for file in ["specificworker.h", "specificworker.cpp", "values.h"] {
        let from = Path::new(COMPONENT).join("src").join(file);
        copy(&from, &folder.join("src").join(file));
    }
    let run = |args: &[&std::ffi::OsStr]| {
        let output = Command::new(cmake.join("cmake")).args(args).output();
        let output = output.expect("cmake");
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
    let strict = "-Wall -Wextra -Wpedantic -Werror";
    run(&[
        "-S".as_ref(),
        folder.as_os_str(),
        "-B".as_ref(),
        build.as_os_str(),
        &set("robocomp_DIR", &config),
        &set("ROBOCOMP_LIBRARY", &native()),
        &set("CMAKE_CXX_FLAGS", Path::new(strict)),
    ]);
    // The linker must not write into a program that runs, which is the same file.
    let linked = build.join("every_type");
    let _ = std::fs::remove_file(&linked);
    run(&["--build".as_ref(), build.as_os_str()]);
    let main = std::fs::read_to_string(folder.join("generated/main.cpp")).expect("a program");
    let description = main.split("R\"rc_json(").nth(1).expect("a description");
    let description = description.split(")rc_json\"").next().expect("its end");
    let mut description: Value = serde_json::from_str(description).expect("JSON");
    let program = build.join(format!("every_type_{}", over.name()));
    // An earlier test may still run it.
    let _ = std::fs::remove_file(&program);
    // A copy could not be started while another thread starts a program: its child has the file open.
    std::fs::hard_link(&linked, &program).expect("a link");
    Some(Package {
        program,
        slots: description["slots"].take(),
    })
}

/// Copies a file if it is another one: cmake goes by the times of files.
fn copy(from: &Path, to: &Path) {
    let text = std::fs::read(from).expect("a file");
    if std::fs::read(to).ok().as_ref() != Some(&text) {
        std::fs::write(to, text).expect("to write");
    }
}

impl Package {
    fn slot(&self, name: &str) -> &Value {
        let mut slots = self.slots.as_array().into_iter().flatten();
        let slot = slots.find(|slot| slot["name"] == name);
        slot.unwrap_or_else(|| panic!("there is no slot {name}"))
    }
}

/// A network of its own.
pub(crate) struct Network {
    name: String,
    over: &'static Over,
}

impl Drop for Network {
    fn drop(&mut self) {
        let directory = RunDirectory::open(&self.name).expect("the run directory");
        let _ = rc_iceoryx2::wipe(&directory);
        let _ = directory.remove();
    }
}

impl Network {
    pub(crate) fn new(over: &'static Over) -> Self {
        let name = format!("cpp-other-{}-{}", over.name(), std::process::id());
        Self { name, over }
    }

    /// Joins it.
    pub(crate) fn join(&self, instance: &str) -> Box<dyn Backend> {
        let mut settings = Settings::default();
        if self.over.domain > 0 {
            let domain = rc_vocabulary::Value::Int(self.over.domain);
            settings.set(self.over.name(), "domain", domain);
            let interfaces = rc_vocabulary::Value::Texts(vec!["lo".to_owned()]);
            settings.set(self.over.name(), "interfaces", interfaces);
        }
        (self.over.connect)(&Environment {
            network: self.name.clone(),
            instance: instance.to_owned(),
            directory: RunDirectory::open(&self.name).expect("a run directory"),
            wake_event: WakeEvent::new().expect("a wake event"),
            settings,
        })
    }

    /// The other end of a slot of the component, which has calls.
    pub(crate) fn calls(
        &self,
        package: &Package,
        slot: &str,
        operations: &[Operation],
    ) -> Endpoint {
        let described = package.slot(slot);
        let name = described["type_name"].as_str().expect("a name").to_owned();
        let hash = described["type_hash"].as_str().expect("a hash");
        let hash = u64::from_str_radix(hash, 16).expect("a hash");
        Endpoint {
            address: self.address(slot),
            types: TypeIdentity { name, hash },
            qos: Qos {
                timeout: LIMIT,
                ..Qos::CALL
            },
            external_types: external(described, operations, operations),
        }
    }

    /// The other end of one topic of a slot of the component.
    pub(crate) fn topic(
        &self,
        package: &Package,
        slot: &str,
        operations: &[Operation],
        operation: &Operation,
        qos: Qos,
    ) -> Endpoint {
        let described = package.slot(slot);
        let name = described["type_name"].as_str().expect("a name");
        Endpoint {
            address: self.address(slot).join(operation.name),
            types: TypeIdentity {
                name: format!("{name}/{}", operation.name),
                hash: operation.type_hash,
            },
            qos,
            external_types: external(described, operations, std::slice::from_ref(operation)),
        }
    }

    fn address(&self, slot: &str) -> Address {
        Address::parse(&format!("{}/{slot}", self.name)).expect("an address")
    }
}

/// The types of ROS 2 of some operations of a slot, which has them over this middleware only.
fn external(slot: &Value, all: &[Operation], of: &[Operation]) -> Vec<ExternalType> {
    let names = slot["external_types"].as_array().into_iter().flatten();
    let pairs = all.iter().zip(names);
    let pairs = pairs.filter(|(operation, _)| of.iter().any(|own| own.id == operation.id));
    pairs
        .map(|(operation, name)| ExternalType {
            slot: slot["name"].as_str().expect("a name").to_owned(),
            operation: operation.name.to_owned(),
            id: operation.id,
            type_name: name.as_str().expect("a name").to_owned(),
        })
        .collect()
}

/// The process at the other end.
pub(crate) struct OtherEnd {
    process: Child,
    /// What it says, which is shown if a test fails.
    said: File,
    pub(crate) package: Package,
    pub(crate) network: Network,
}

impl Drop for OtherEnd {
    fn drop(&mut self) {
        self.kill();
        if std::thread::panicking() {
            eprintln!("{}", self.said());
        }
    }
}

pub(crate) fn native() -> PathBuf {
    let own = std::env::current_exe().expect("this program");
    own.with_file_name("librobocomp_cpp.so")
}

impl OtherEnd {
    pub(crate) fn start(network: Network, package: Package) -> Self {
        let name = &network.name;
        let mut command = Command::new(&package.program);
        command.args(["--network", name, "--log", "error"]);
        if network.over.domain > 0 {
            let (over, domain) = (network.over.name(), network.over.domain);
            for setting in [format!("domain={domain}"), "interfaces=lo".to_owned()] {
                command.args(["--set-middleware", &format!("{over}.{setting}")]);
            }
        }
        let said = tempfile::tempfile().expect("a file");
        command.stderr(said.try_clone().expect("a descriptor"));
        Self {
            said,
            process: command.spawn().expect("the program"),
            package,
            network,
        }
    }

    /// What the component has said so far.
    pub(crate) fn said(&mut self) -> String {
        let mut said = String::new();
        let _ = self.said.rewind();
        let _ = self.said.read_to_string(&mut said);
        said
    }

    pub(crate) fn kill(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
