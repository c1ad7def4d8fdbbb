//! `rcgen export`: the written files, their acceptance by the compiler of Cyclone DDS, and the
//! bytes of the exported types.

#![allow(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use crate::folders::{changed, files, rcgen};
use crate::{idlc, workspace};
use expect_test::{expect, expect_file};
use rc_test_support::python;
use std::path::Path;
use std::process::{Command, Stdio};
use tempfile::TempDir;

const HERE: &str = env!("CARGO_MANIFEST_DIR");

/// A folder with `M.idsl`.
fn folder(idsl: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("M.idsl"), idsl).expect("a file");
    folder
}

const EXPORT: [&str; 6] = ["export", "M.idsl", "--to", "dds", "--out", "out"];

/// Compares `M.idl` with the file in `tests/export/golden`.
fn check(name: &str, idsl: &str) {
    let folder = folder(idsl);
    let (code, _, err) = rcgen(folder.path(), &EXPORT);
    assert_eq!((code, err.as_str()), (0, ""));
    let text = std::fs::read_to_string(folder.path().join("out/M.idl")).expect("a file");
    expect_file![format!("{HERE}/tests/export/golden/{name}.idl")].assert_eq(&text);
}

#[test]
fn types() {
    check(
        "types",
        "module M {
            const int rings = 16;
            const double half = 5e-1;
            const string word = \"a \\\"b\\\"\";
            const bool on = true;
            /// How it turns.
            enum Mode { idle, /** Fast. */ fast = 5, faster };
            enum Sign { minus = -1, plus = 1 };
            struct Scan {
                /// All of them.
                Points points;
                bool a; byte b; short c; int d; long e; float f; double g;
                int8 h; uint8 i; uint16 j; uint32 k; uint64 l;
                string m; string<16> n;
                sequence<double> o; sequence<sequence<string<4>, 3>, 2> p; sequence<sequence<int>> q;
                float r[16]; string<3> s[2]; Mode t[4];
            };
            struct Point { float x; };
            sequence<Point, 64> Points;
            dictionary<string, Point> Named;
            struct Nothing { };
            exception Failed { string what; };
            exception Worse extends Failed { Mode mode; };
        };",
    );
}

#[test]
fn annotations() {
    check(
        "annotations",
        "module M {
            enum Mode { idle, fast };
            struct Wheel {
                /// How fast.
                @unit(\"m/s\") @range(min=-1, max=2.5) float speed = 1;
                @range(min=0) int least;
                @range(max=9) long most = -9000000000;
                @default(fast) Mode mode;
                string<8> name = \"nobody\";
                bool on = true;
                @optional @unit(\"mm\") @range(min=0, max=3) @default(1) int maybe;
                @optional float pose[3];
                @optional Mode other;
            };
            struct Hides { @unit(\"m\") int unit; @unit(\"m\") int x; @range(min=0, max=1) int Range; };
        };",
    );
}

/// Keywords of IDL, names that differ only in case, enumerators, and names of annotations.
#[test]
fn names() {
    check(
        "names",
        "module M {
            struct union { int switch; int Struct; int _1; int Union; };
            struct Uses { union Union; M m; };
            struct M { int m; };
            enum A { on, off, only };
            enum B { On, maybe };
            enum C { value, wchar };
            const int final = 1;
            const int octet = 2;
            struct Range { int min; };
        };",
    );
}

#[test]
fn topics_and_calls() {
    check(
        "topics_and_calls",
        "module M {
            exception Failed { string what; };
            exception Gone { };
            /// A base.
            interface Base {
                /// Where it is.
                float pose(string frame, @optional int age, @unit(\"mm\") out int x) throws Failed, Gone;
                command stop();
            };
            interface Scans { publish scan(sequence<float> ranges); publish void nothing(); };
            interface Either { void set(@range(min=0, max=1) float level); };
        };",
    );
}

#[test]
fn imports_are_exported_and_included() {
    let folder = folder(
        "import \"Laser.idsl\"; import \"Own.idsl\";\nmodule M { struct S { RoboCompLaser::TData a; Own::T b; }; };",
    );
    std::fs::create_dir(folder.path().join("more")).expect("a folder");
    std::fs::write(
        folder.path().join("more/Own.idsl"),
        "module Own { struct T { int x; }; };",
    )
    .expect("a file");
    let args: Vec<&str> = EXPORT.into_iter().chain(["-I", "more"]).collect();
    let (code, out, err) = rcgen(folder.path(), &[&args[..], &["--dry-run"]].concat());
    assert_eq!((code, err.as_str()), (0, ""));
    expect![[r#"
        create out/GenericBase.idl
        create out/Laser.idl
        create out/M.idl
        create out/Own.idl
        create out/dds_rpc.idl
    "#]]
    .assert_eq(&out);
    assert!(!folder.path().join("out").exists());
    let (code, written, _) = rcgen(folder.path(), &args);
    assert_eq!((code, written), (0, out));
    let text = std::fs::read_to_string(folder.path().join("out/M.idl")).expect("a file");
    expect![[r#"
        // Exported by rcgen from M.idsl; rewritten at every export.
        #ifndef RCGEN_M_IDL
        #define RCGEN_M_IDL

        #include "Laser.idl"
        #include "Own.idl"

        module M
        {
            @final
            struct S
            {
                ::RoboCompLaser::TData a;
                ::Own::T b;
            };
        };

        #endif
    "#]]
    .assert_eq(&text);
    let (code, out, _) = rcgen(folder.path(), &args);
    assert_eq!((code, out.as_str()), (0, ""), "all is as it was");
}

/// Found as imports find them.
#[test]
fn bundled_interfaces_need_no_path() {
    let folder = tempfile::tempdir().expect("a folder");
    let args = ["export", "GenericBase.idsl", "--to", "dds", "--out", "."];
    let (code, out, err) = rcgen(folder.path(), &args);
    assert_eq!((code, err.as_str()), (0, ""));
    assert_eq!(out, "create ./GenericBase.idl\ncreate ./dds_rpc.idl\n");
}

/// The exit code and the standard error of an export that writes nothing.
fn refused(idsl: &str, args: &[&str]) -> (i32, String) {
    let folder = folder(idsl);
    let before = files(folder.path());
    let (code, out, err) = rcgen(folder.path(), args);
    assert_eq!(out, "");
    assert_eq!(changed(&before, &files(folder.path())), [""; 0]);
    (code, err)
}

#[test]
fn an_invalid_export_writes_nothing() {
    let (code, err) = refused("module M { struct S { in x; }; };", &EXPORT);
    assert_eq!(code, 1);
    assert!(err.contains("M.idsl:1:23"), "{err}");
    for (to, code, says) in [
        (
            "slice",
            2,
            "slice comes with a later version; there are dds, ros2, urdf, gltf, dsr, graphml, turtle, graph, rust, c, cpp, python, ctypes and ilk",
        ),
        ("ddz", 2, "did you mean `dds`?"),
        (
            "corba",
            2,
            "there are dds, ros2, urdf, gltf, dsr, graphml, turtle, graph, rust, c, cpp, python, ctypes and ilk",
        ),
    ] {
        let args = ["export", "M.idsl", "--to", to, "--out", "out"];
        let (found, err) = refused("module M { };", &args);
        assert_eq!(found, code, "{err}");
        assert!(err.contains(says), "{err}");
    }
    let args = ["export", "M.cdsl", "--to", "dds", "--out", "out"];
    let (code, err) = refused("module M { };", &args);
    assert_eq!(code, 2);
    assert!(err.contains("M.cdsl is not an .idsl file"), "{err}");
    let args = ["export", "N.idsl", "--to", "dds", "--out", "out"];
    assert_eq!(refused("module M { };", &args).0, 3);
}

#[test]
fn names_invalid_in_idl_are_rejected() {
    let short: Vec<&str> = EXPORT.into_iter().chain(["--format", "short"]).collect();
    let all = [
        "module M { struct laser_GO { int x; }; interface Laser { void go(); }; };",
        "module M { interface A { void b_In(); void b(); }; };",
        "module Dds { };",
        "module range { };",
        "module _M { };",
        "module M { interface _I { void go(); }; };",
    ];
    let report: Vec<String> = all
        .map(|idsl| refused(idsl, &short))
        .into_iter()
        .map(|(code, err)| {
            assert_eq!(code, 1, "{err}");
            err
        })
        .collect();
    expect![[r#"
        M.idsl:1:63: error[export-name]: the name `Laser_go` of `go` in OMG IDL is already in use (rename one of the declarations: OMG IDL ignores case)
        M.idsl:1:44: error[export-name]: the name `A_b_In` of `b` in OMG IDL is already in use (rename one of the declarations: OMG IDL ignores case)
        M.idsl:1:8: error[export-name]: the name of module `Dds` is reserved in OMG IDL
        M.idsl:1:8: error[export-name]: module `range` would hide an annotation of OMG IDL
        M.idsl:1:8: error[export-name]: `_M` is not valid in OMG IDL: it begins with `_`
        M.idsl:1:22: error[export-name]: `_I` is not valid in OMG IDL: it begins with `_`
    "#]].assert_eq(&report.concat());

    let folder = folder(
        "import \"a/N.idsl\"; import \"n.idsl\";\nmodule M { interface I { void go() throws A::Bad, B::Bad; }; };",
    );
    std::fs::create_dir(folder.path().join("a")).expect("a folder");
    let write = |file: &str, text: &str| {
        std::fs::write(folder.path().join(file), text).expect("a file");
    };
    write("a/N.idsl", "module A { exception Bad { int x; }; };");
    write("n.idsl", "module B { exception Bad { int y; }; };");
    let (code, _, err) = rcgen(folder.path(), &short);
    assert_eq!(code, 1);
    expect![[r#"
        M.idsl:2:31: error[export-name]: `go` throws two exceptions named `Bad`, which DDS-RPC cannot distinguish; first exception at a/N.idsl:1:22; second exception at n.idsl:1:22
        n.idsl:1:8: error[export-name]: two modules would be exported to the same file `n.idl`; other module at a/N.idsl:1:8 (rename the .idsl file: the exported file has the same name)
    "#]].assert_eq(&err);
}

#[test]
fn a_file_not_generated_by_rcgen_is_not_overwritten() {
    let folder = folder("module M { };");
    std::fs::create_dir(folder.path().join("out")).expect("a folder");
    std::fs::write(folder.path().join("out/M.idl"), "// mine\n").expect("a file");
    let before = files(folder.path());
    let (code, _, err) = rcgen(folder.path(), &EXPORT);
    assert_eq!(code, 2);
    assert!(
        err.contains("out/M.idl is there, and was not written by an export"),
        "{err}"
    );
    assert_eq!(changed(&before, &files(folder.path())), [""; 0]);
}

/// All bundled interfaces, and files with every construct.
#[test]
fn the_compiler_of_cyclone_accepts_every_file() {
    let Some(idlc) = idlc::idlc("the_compiler_of_cyclone_accepts_every_file") else {
        return;
    };
    let interfaces = std::fs::read_dir(Path::new(HERE).join("../../components/interfaces"));
    let interfaces = interfaces
        .expect("the interfaces")
        .flatten()
        .map(|file| file.path());
    let mut all: Vec<_> = interfaces
        .filter(|path| path.extension().is_some_and(|e| e == "idsl"))
        .collect();
    assert!(all.len() >= 10, "{all:?}");
    let own = [
        "compile/everything/Everything",
        "compile/placed/Placed",
        "compile/awkward/Awkward",
        "export/Exported",
    ];
    all.extend(own.map(|file| Path::new(HERE).join(format!("tests/{file}.idsl"))));
    for path in all {
        let folder = tempfile::tempdir().expect("a folder");
        let path = path.to_string_lossy();
        let (code, _, err) = rcgen(
            folder.path(),
            &["export", &path, "--to", "dds", "--out", "."],
        );
        assert_eq!(code, 0, "{path}: {err}");
        let exported: Vec<_> = files(folder.path()).into_keys().collect();
        assert!(!exported.is_empty());
        for file in exported {
            idlc.compile(folder.path(), &file);
        }
    }
    // The golden file of another test, beside the files that it includes.
    let folder = folder("import \"Laser.idsl\"; module M { };");
    let args = ["export", "M.idsl", "--to", "dds", "--out", "."];
    assert_eq!(rcgen(folder.path(), &args).0, 0);
    let golden = std::fs::read_dir(Path::new(HERE).join("tests/export/golden"));
    for file in golden.expect("the files").flatten() {
        let name = file.file_name();
        std::fs::copy(file.path(), folder.path().join(&name)).expect("a copy");
        idlc.compile(folder.path(), Path::new(&name));
    }
}

/// A Python program with types from the exported file and the package `cyclonedds`, and a generated
/// component: both write and read topics, requests, replies and exceptions.
#[test]
fn python_and_components_write_the_same_bytes() {
    let test = "python_and_components_write_the_same_bytes";
    let Some(python) = python::interpreter("cyclonedds==11.0.1", test) else {
        return;
    };
    let fixtures = Path::new(HERE).join("tests/export");
    let folder = tempfile::tempdir().expect("a folder");
    let stranger = |what: &str, input: Stdio| {
        let output = Command::new(python)
            .arg(fixtures.join("stranger.py"))
            .arg(what)
            .stdin(input)
            .output();
        let output = output.expect("Python");
        let said = String::from_utf8(output.stdout).expect("a text");
        let err = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{err}");
        said
    };
    let samples = folder.path().join("samples");
    std::fs::write(&samples, stranger("write", Stdio::null())).expect("a file");
    let ours = folder.path().join("ours");
    workspace::check(folder.path(), &fixtures, &samples, &ours);
    let read = stranger("read", std::fs::File::open(&ours).expect("a file").into());
    let mut read: Vec<&str> = read.lines().collect();
    read.sort_unstable();
    let samples = std::fs::read_to_string(&samples).expect("samples");
    let mut all: Vec<&str> = samples
        .lines()
        .filter_map(|line| line.split(' ').next())
        .filter(|name| *name != "unknown-request")
        .collect();
    all.sort_unstable();
    assert_eq!(read, all);
}

/// A second export changes nothing, and one of a changed file replaces what the first one wrote.
#[test]
fn a_tree_is_exported_again_and_foreign_files_stay() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    let nodes = |count: usize| {
        let nodes = (0..count).map(|n| format!("<transform id=\"t{n}\"/>"));
        let text = format!("<innerModel>{}</innerModel>", nodes.collect::<String>());
        std::fs::write(folder.join("a.xml"), text).expect("a file");
    };
    for (to, name) in [("gltf", "a.glb"), ("urdf", "a.urdf")] {
        let args = ["export", "a.xml", "--to", to, "--out", "out"];
        for (count, word) in [(100, "create "), (100, ""), (101, "update ")] {
            nodes(count);
            let (code, out, err) = rcgen(folder, &args);
            assert_eq!(code, 0, "{to}: {err}");
            assert!(
                out.starts_with(word) && out.is_empty() == word.is_empty(),
                "{out}"
            );
        }
        let path = folder.join("out").join(name);
        std::fs::write(&path, "glTF of another program, not of rcgen").expect("a file");
        assert_eq!(rcgen(folder, &args).0, 2);
    }
}
