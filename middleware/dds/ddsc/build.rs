//! Compiles Cyclone DDS from the sources of the crate `cyclonedds-src`, with nothing but a C compiler: no cmake, no
//! libclang. What cmake would find out about the system is written in `include/`.

use std::path::{Path, PathBuf};

/// Folders whose files all belong to the library.
const WHOLE: [&str; 3] = ["core/ddsi/src", "core/ddsc/src", "core/cdr/src"];

/// Files of these folders that belong to a part that `include/dds/features.h` leaves out.
const LEFT_OUT: [&str; 15] = [
    "dds_dynamic_type.c",
    "dds_qos_provider.c",
    "dds_sysdef_parser.c",
    "dds_sysdef_validation.c",
    "ddsi_discovery_topic.c",
    "ddsi_dynamic_type.c",
    "ddsi_security_exchange.c",
    "ddsi_security_msg.c",
    "ddsi_typebuilder.c",
    "ddsi_typelib.c",
    "ddsi_typelookup.c",
    "ddsi_typewrap.c",
    "ddsi_xt_typeinfo.c",
    "ddsi_xt_typelookup.c",
    "ddsi_xt_typemap.c",
];

/// The layer over the system: what is the same on every system, and what is for Linux.
const SYSTEM: [&str; 40] = [
    "atomics.c",
    "avl.c",
    "bits.c",
    "bswap.c",
    "cdtors.c",
    "circlist.c",
    "dynlib.c",
    "dynlib/posix/dynlib.c",
    "environ.c",
    "environ/posix/environ.c",
    "expand_vars.c",
    "fibheap.c",
    "filesystem/posix/filesystem.c",
    "heap/posix/heap.c",
    "hopscotch.c",
    "ifaddrs.c",
    "ifaddrs/posix/ifaddrs.c",
    "io.c",
    "log.c",
    "machineid.c",
    "md5.c",
    "mh3.c",
    "netstat/linux/netstat.c",
    "process/posix/process.c",
    "random.c",
    "random/posix/random.c",
    "retcode.c",
    "rusage/posix/rusage.c",
    "sockets.c",
    "sockets/posix/gethostname.c",
    "sockets/posix/socket.c",
    "string.c",
    "strtod.c",
    "strtol.c",
    "sync/posix/sync.c",
    "threads.c",
    "threads/posix/threads.c",
    "time.c",
    "time/posix/time.c",
    "xmlparser.c",
];

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=include");
    println!("cargo:rerun-if-changed=src/shim.c");
    let target = std::env::var("CARGO_CFG_TARGET_OS").unwrap_or_default();
    assert!(
        target == "linux",
        "the DDS backend is built for Linux only, not for {target}"
    );
    let source = cyclonedds_src::source_dir().join("src");
    let mut build = cc::Build::new();
    build
        .include("include")
        .include(source.join("ddsrt/include"))
        .include(source.join("ddsrt/src"))
        .include(source.join("core/cdr/include"))
        .include(source.join("core/ddsi/include"))
        .include(source.join("core/ddsi/src"))
        .include(source.join("core/ddsc/include"))
        .include(source.join("core/ddsc/src"))
        .include(source.join("security/api/include"))
        .include(source.join("security/core/include"))
        // The library is quick or slow for everybody; who debugs a component does not debug it.
        .opt_level(2)
        .debug(false)
        .define("NDEBUG", None)
        .flag_if_supported("-fno-strict-aliasing")
        .warnings(false);
    let mut files: Vec<PathBuf> = SYSTEM
        .iter()
        .map(|name| source.join("ddsrt/src").join(name))
        .collect();
    files.push(source.join("core/ddsi/defconfig.c"));
    for folder in WHOLE {
        files.extend(c_files(&source.join(folder)));
    }
    build.files(&files).file("src/shim.c").compile("rc_ddsc");
}

fn c_files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder)
        .unwrap_or_else(|error| panic!("{} of cyclonedds-src: {error}", folder.display()));
    let mut files: Vec<PathBuf> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|ending| ending == "c"))
        .filter(|path| !LEFT_OUT.iter().any(|name| path.ends_with(name)))
        .collect();
    files.sort();
    files
}
