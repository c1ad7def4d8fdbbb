//! Compiles Cyclone DDS from the sources of the crate `cyclonedds-src`, with nothing but a C
//! compiler: no cmake, no libclang. `include/` holds the facts about the system that cmake would
//! find out.

use std::fs::File;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
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

/// The layer over the system: files for every system, and those for Linux.
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

/// The file that `src/transmit.c` includes and replaces, and how often it calls the functions that
/// are hooked there.
const TRANSMIT: &str = "ddsi_transmit.c";
const HOOKED: [(&str, usize); 3] = [
    ("ddsi_xmsg_addpar_sentinel_ifparam (", 2),
    ("ddsi_xmsg_serdata (", 3),
    ("ddsi_xpack_addmsg (", 6),
];

/// A file that is compiled with one place replaced.
struct Replaced {
    file: &'static str,
    found: &'static str,
    by: &'static str,
}

/// Both are about writers of Fast DDS (vendor 1.15).
const REPLACED: [Replaced; 2] = [
    // The first heartbeat of a writer of another library lets a volatile reader pass over all
    // samples up to the last one, also over those whose fragments arrive at that moment: the first
    // large request of a node on Fast DDS was lost. Fast DDS sends a new reader nothing old.
    Replaced {
        file: "ddsi_receive.c",
        found: "gap_end_seq = lastseq + 1;",
        by: "gap_end_seq = pwr->c.vendor.id[0] == 1 && pwr->c.vendor.id[1] == 15 ? firstseq : lastseq + 1;",
    },
    // A reader asks a new writer for a heartbeat. Fast DDS replies at once only if the base is 0,
    // as its own readers write it, else at its next heartbeat: a request that a client had sent
    // before its server found it waited for 3 s.
    Replaced {
        file: "ddsi_acknack.c",
        found: "bitmap_base = ddsi_to_seqno (1);",
        by: "bitmap_base = ddsi_to_seqno (pwr->c.vendor.id[0] == 1 && pwr->c.vendor.id[1] == 15 ? 0 : 1);",
    },
];

/// The static library of the C sources, without the shim.
const LIBRARY: &str = "rc_cyclonedds";

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=include");
    println!("cargo:rerun-if-changed=src/shim.c");
    println!("cargo:rerun-if-changed=src/transmit.c");
    let target = std::env::var("CARGO_CFG_TARGET_OS").unwrap_or_default();
    assert!(
        target == "linux",
        "the DDS backend is built for Linux only, not for {target}"
    );
    let source = cyclonedds_src::source_dir().join("src");
    // The linker takes the libraries in this order: the shim calls the C library.
    compiler(&source).file("src/shim.c").compile("rc_ddsc");
    let library = shared_library(&source).unwrap_or_else(|error| {
        panic!("the compiled Cyclone DDS cannot be kept in the target folder: {error}")
    });
    // A target folder may be partly deleted.
    println!("cargo:rerun-if-changed={}", library.display());
    println!("cargo:rustc-link-search=native={}", library.display());
    println!("cargo:rustc-link-lib=static={LIBRARY}");
}

/// The C compiler with the options of the library.
fn compiler(source: &Path) -> cc::Build {
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
        // One speed in all profiles: a user debugs a component, not the library.
        .opt_level(2)
        .debug(false)
        .define("NDEBUG", None)
        .flag_if_supported("-fno-strict-aliasing")
        .warnings(false);
    build
}

/// The folder with the compiled C sources. All profiles and workspaces of one target folder share
/// it, because the compilation takes a minute or two and is the same for all of them. The folder's
/// name is a hash of all inputs.
fn shared_library(source: &Path) -> io::Result<PathBuf> {
    let out = PathBuf::from(std::env::var_os("OUT_DIR").unwrap_or_default());
    // TARGET/PROFILE/build/PACKAGE-HASH/out
    let target = out
        .ancestors()
        .nth(4)
        .ok_or_else(|| io::Error::other("OUT_DIR is not below a target folder"))?;
    let cache = target.join("rc-ddsc");
    std::fs::create_dir_all(&cache)?;
    let folder = cache.join(format!("{:016x}", fingerprint(source)?));
    let lock = File::create(cache.join(".lock"))?;
    lock.lock()?;
    if folder.join(format!("lib{LIBRARY}.a")).exists() {
        return Ok(folder);
    }
    // A killed build leaves this folder, and the next build starts over.
    let partial = cache.join("partial");
    if partial.exists() {
        std::fs::remove_dir_all(&partial)?;
    }
    std::fs::create_dir(&partial)?;
    compiler(source)
        .files(sources(source))
        .out_dir(&partial)
        .cargo_metadata(false)
        .compile(LIBRARY);
    // Only the library is kept: the objects take as much room again.
    for entry in std::fs::read_dir(&partial)? {
        let path = entry?.path();
        if path.extension().is_none_or(|ending| ending != "a") {
            std::fs::remove_file(path)?;
        }
    }
    std::fs::rename(&partial, &folder)?;
    Ok(folder)
}

/// A hash of all that the compiled library depends on: sources, options, compiler.
fn fingerprint(source: &Path) -> io::Result<u64> {
    let mut hasher = DefaultHasher::new();
    // The crate with the sources has an exact version, and the path of its folder names it.
    source.hash(&mut hasher);
    for file in ["build.rs", "src/transmit.c"] {
        std::fs::read(file)?.hash(&mut hasher);
    }
    let mut headers = vec![PathBuf::from("include")];
    while let Some(path) = headers.pop() {
        if path.is_dir() {
            let mut entries: Vec<PathBuf> = std::fs::read_dir(&path)?
                .map(|entry| entry.map(|entry| entry.path()))
                .collect::<io::Result<_>>()?;
            entries.sort();
            headers.extend(entries);
        } else {
            path.hash(&mut hasher);
            std::fs::read(&path)?.hash(&mut hasher);
        }
    }
    let tool = compiler(source).get_compiler();
    tool.path().hash(&mut hasher);
    tool.args().hash(&mut hasher);
    let version = std::process::Command::new(tool.path())
        .arg("--version")
        .output()?;
    version.stdout.hash(&mut hasher);
    Ok(hasher.finish())
}

/// The C files of the library.
fn sources(source: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = SYSTEM
        .iter()
        .map(|name| source.join("ddsrt/src").join(name))
        .collect();
    files.push(source.join("core/ddsi/defconfig.c"));
    for folder in WHOLE {
        files.extend(c_files(&source.join(folder)));
    }
    *file(&mut files, TRANSMIT, &HOOKED).0 = PathBuf::from("src/transmit.c");
    let out = PathBuf::from(std::env::var_os("OUT_DIR").unwrap_or_default());
    for Replaced {
        file: name,
        found,
        by,
    } in REPLACED
    {
        let (path, text) = file(&mut files, name, &[(found, 1)]);
        let changed = out.join(name);
        std::fs::write(&changed, text.replace(found, by))
            .unwrap_or_else(|error| panic!("{}: {error}", changed.display()));
        *path = changed;
    }
    files
}

/// The file `name` and its text, which has each of these parts so many times.
fn file<'a>(
    files: &'a mut [PathBuf],
    name: &str,
    parts: &[(&str, usize)],
) -> (&'a mut PathBuf, String) {
    let path = files.iter_mut().find(|path| path.ends_with(name));
    let path = path.unwrap_or_else(|| panic!("cyclonedds-src has no {name}"));
    let text = std::fs::read_to_string(&*path).unwrap_or_default();
    for (part, count) in parts {
        let found = text.matches(part).count();
        assert!(
            found == *count,
            "{name} of cyclonedds-src has `{part}` {found} times, not {count}: look at build.rs and src/transmit.c"
        );
    }
    (path, text)
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
