//! `rcgen export --to ros2` and `@ros`: the packages, their interpretation by ROS 2's own tools,
//! their bytes on the wire, and the diagnostics.

#![allow(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use crate::folders::{changed, files, rcgen};
use crate::{rosidl, wire};
use expect_test::{expect, expect_file};
use rc_codegen::{FileLoader, export, ros};
use rc_diagnostics::SourceMap;
use rc_test_support::python;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use tempfile::TempDir;

const HERE: &str = env!("CARGO_MANIFEST_DIR");
const EXPORT: [&str; 6] = ["export", "M.idsl", "--to", "ros2", "--out", "out"];

/// A folder with `M.idsl`.
fn folder(idsl: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("M.idsl"), idsl).expect("a file");
    folder
}

/// All files below `folder` in one text.
fn all(folder: &Path) -> String {
    let texts = files(folder).into_iter().map(|(path, text)| {
        let text = String::from_utf8(text).expect("a text");
        format!("==> {}\n{text}", path.display())
    });
    texts.collect()
}

const WHOLE: &str = include_str!("../ros/Whole.idsl");

#[test]
fn an_export_writes_a_package() {
    let folder = folder(WHOLE);
    let (code, _, err) = rcgen(folder.path(), &EXPORT);
    assert_eq!((code, err.as_str()), (0, ""));
    expect_file![format!("{HERE}/tests/ros/whole.txt")].assert_eq(&all(&folder.path().join("out")));
    let (code, out, _) = rcgen(folder.path(), &EXPORT);
    assert_eq!((code, out.as_str()), (0, ""), "all is as it was");
}

/// The fields as ROS 2's own parser reads them.
#[test]
fn fields_reach_the_parser_of_ros() {
    let Some(rosidl) = rosidl::rosidl("fields_reach_the_parser_of_ros") else {
        return;
    };
    let folder = folder(WHOLE);
    assert_eq!(rcgen(folder.path(), &EXPORT).0, 0);
    let found = rosidl.read(&[folder.path().join("out")]);
    let fields: Vec<&str> = found
        .lines()
        .filter_map(|line| line.strip_prefix("fields robocomp_whole_msgs/"))
        .collect();
    expect![[r#"
        msg/Constants: ; int32 MAX_RINGS=16; string WORD='a "b"'
        msg/EitherSet: float32 level
        msg/Failed: string what
        msg/Mode: ; int32 IDLE=0; int32 FAST_MODE=5; int32 NULL_VALUE=-1
        msg/NamedEntry: string key, robocomp_whole_msgs/TPoint value
        msg/Nothing: 
        msg/Scan: robocomp_whole_msgs/TPoint[<=64] points, robocomp_whole_msgs/NamedEntry[] named, int32 mode 5, int32[] modes, uint8[] raw, robocomp_whole_msgs/ScanRowsElement[<=2] rows, robocomp_whole_msgs/ScanPoseElement[<=1] pose, int32[<=1] maybe, string<=16 name 'it's', string note, bool class_value True, int64 big, robocomp_whole_msgs/ScanAllElement[] all, string<=4[2] tags
        msg/ScanAllElement: robocomp_whole_msgs/TPoint[<=64] data
        msg/ScanPoseElement: float32[3] data
        msg/ScanRowsElement: int32[] data
        msg/ScansNothing: 
        msg/ScansTwoScans: robocomp_whole_msgs/Scan a, robocomp_whole_msgs/Scan b
        msg/TPoint: float32 x, float32 y_down -1.5
        msg/Worse: string what, int32 mode
        srv/EitherSet_Request: float32 level
        srv/EitherSet_Response: 
        srv/WholePose_Request: string frame, int32[<=1] age
        srv/WholePose_Response: int32 code_of_result, robocomp_whole_msgs/Failed failed, robocomp_whole_msgs/Worse worse, int32 x, int32 code, float32 result; int32 OK=0; int32 FAILED=1; int32 WORSE=2
        srv/WholeResult_Request: robocomp_whole_msgs/Scan scan
        srv/WholeResult_Response: robocomp_whole_msgs/TPoint[<=64] result, robocomp_whole_msgs/TPoint[<=64] result_value
        srv/WholeStop_Request: 
        srv/WholeStop_Response: "#]].assert_eq(&fields.join("\n"));
}

#[test]
fn modules_become_packages_with_dependencies() {
    let folder = folder(
        "import \"Laser.idsl\"; import \"Own.idsl\";
        @ros(\"my_robot_msgs\") module M { struct S { RoboCompLaser::TData a; Own::Stamp b; }; };",
    );
    std::fs::write(
        folder.path().join("Own.idsl"),
        "module Own { @ros(\"builtin_interfaces/msg/Time\") struct Stamp { int sec; uint32 nanosec; }; };",
    )
    .expect("a file");
    let (code, out, err) = rcgen(folder.path(), &[&EXPORT[..], &["--dry-run"]].concat());
    assert_eq!((code, err.as_str()), (0, ""));
    assert!(!folder.path().join("out").exists());
    // The module `Own` has only standard types and becomes no package.
    expect![[r#"
        create out/my_robot_msgs/CMakeLists.txt
        create out/my_robot_msgs/msg/S.msg
        create out/my_robot_msgs/package.xml
        create out/robocomp_generic_base_msgs/CMakeLists.txt
        create out/robocomp_generic_base_msgs/msg/HardwareFailedException.msg
        create out/robocomp_generic_base_msgs/msg/TBaseState.msg
        create out/robocomp_generic_base_msgs/package.xml
        create out/robocomp_generic_base_msgs/srv/GenericBaseGetBasePose.srv
        create out/robocomp_generic_base_msgs/srv/GenericBaseGetBaseState.srv
        create out/robocomp_laser_msgs/CMakeLists.txt
        create out/robocomp_laser_msgs/msg/LaserConfData.msg
        create out/robocomp_laser_msgs/msg/TData.msg
        create out/robocomp_laser_msgs/package.xml
        create out/robocomp_laser_msgs/srv/LaserGetLaserAndBStateData.srv
        create out/robocomp_laser_msgs/srv/LaserGetLaserConfData.srv
        create out/robocomp_laser_msgs/srv/LaserGetLaserData.srv
    "#]]
    .assert_eq(&out);
    assert_eq!(rcgen(folder.path(), &EXPORT).0, 0);
    let text = std::fs::read_to_string(folder.path().join("out/my_robot_msgs/msg/S.msg"));
    expect![[r#"
        # Exported by rcgen from M.idsl; rewritten at every export.

        robocomp_laser_msgs/TData a
        builtin_interfaces/Time b
    "#]]
    .assert_eq(&text.expect("a file"));
    let text = std::fs::read_to_string(folder.path().join("out/my_robot_msgs/package.xml"));
    let depends: Vec<String> = text
        .expect("a file")
        .lines()
        .filter(|line| line.contains("<depend>"))
        .map(|line| line.trim().to_owned())
        .collect();
    expect![[r#"
          <depend>builtin_interfaces</depend>
          <depend>robocomp_laser_msgs</depend>"#]]
    .assert_eq(&depends.join("\n"));
}

#[test]
fn a_module_of_standard_types_only_is_not_exported() {
    let folder = folder(
        "module M { @ros(\"builtin_interfaces/msg/Time\") struct T { int sec; uint32 nanosec; }; };",
    );
    let (code, out, err) = rcgen(folder.path(), &EXPORT);
    assert_eq!((code, out.as_str()), (0, ""));
    assert_eq!(err, "M.idsl: there is nothing to export in it\n");
    assert!(!folder.path().join("out").exists());
}

#[test]
fn a_file_not_generated_by_rcgen_is_not_overwritten() {
    for (name, mine) in [
        ("package.xml", "<?xml version=\"1.0\"?>\n"),
        ("msg/S.msg", "int32 x\n"),
    ] {
        let folder = folder("module M { struct S { int x; }; };");
        assert_eq!(rcgen(folder.path(), &EXPORT).0, 0);
        let path = format!("out/robocomp_m_msgs/{name}");
        std::fs::write(folder.path().join(&path), mine).expect("a file");
        let before = files(folder.path());
        let (code, _, err) = rcgen(folder.path(), &EXPORT);
        assert_eq!(code, 2);
        let says = format!("{path} is there, and was not written by an export");
        assert!(err.contains(&says), "{err}");
        assert_eq!(changed(&before, &files(folder.path())), [""; 0]);
    }
}

/// The short diagnostics of `rcgen` about `M.idsl`. Checks that it writes nothing.
fn findings(command: &[&str], idsl: &str, expected: i32) -> String {
    let folder = folder(idsl);
    let before = files(folder.path());
    let args = [command, &["--format", "short"]].concat();
    let (code, out, err) = rcgen(folder.path(), &args);
    assert_eq!(code, expected, "{idsl}\n{err}");
    if expected != 0 {
        assert_eq!(
            (out.as_str(), changed(&before, &files(folder.path())).len()),
            ("", 0)
        );
    }
    err
}

#[test]
fn names_that_collide_in_ros_are_rejected() {
    let all = [
        "module M { struct S { int someName; int some_name; }; };",
        "module M { struct TData { int x; }; struct T_Data { int x; }; };",
        "module M { struct Data { int x; }; struct D_Ata { int x; }; };",
        "module M { enum E { oneTwo, one_two }; const int aB = 1; const int a_b = 1; };",
        "module M { struct LaserGo { int x; }; interface Laser { publish go(int a, int b); }; };",
        "module M { dictionary<int, int> A; struct AEntry { int x; }; };",
        "module M { interface A { void bC(); }; interface AB { void c(); }; };",
        "module M { struct S { sequence<sequence<int>> a; }; struct SAElement { int x; }; };",
    ];
    let printed: Vec<String> = all.map(|idsl| findings(&EXPORT, idsl, 1)).into();
    expect![[r#"
        M.idsl:1:41: error[ros-name]: members `someName` and `some_name` both become `some_name` in ROS 2; other declaration at M.idsl:1:27 (rename one of them)
        M.idsl:1:44: error[ros-name]: `TData` and `T_Data` both become `msg/TData` in ROS 2; other declaration at M.idsl:1:19 (rename one of them)
        M.idsl:1:43: error[ros-name]: `Data` and `D_Ata` become `msg/Data` and `msg/DAta` in ROS 2, which differ only in case; other declaration at M.idsl:1:19 (rename one of them)
        M.idsl:1:29: error[ros-name]: enumerators `oneTwo` and `one_two` both become `ONE_TWO` in ROS 2; other declaration at M.idsl:1:21 (rename one of them)
        M.idsl:1:68: error[ros-name]: constants `aB` and `a_b` both become `A_B` in ROS 2; other declaration at M.idsl:1:50 (rename one of them)
        M.idsl:1:65: error[ros-name]: `LaserGo` and `go` both become `msg/LaserGo` in ROS 2; other declaration at M.idsl:1:19 (rename one of them)
        M.idsl:1:43: error[ros-name]: `A` and `AEntry` both become `msg/AEntry` in ROS 2; other declaration at M.idsl:1:33 (rename one of them)
        M.idsl:1:60: error[ros-name]: `bC` and `c` both become `msg/ABC` in ROS 2; other declaration at M.idsl:1:31 (rename one of them)
        M.idsl:1:60: error[ros-name]: `bC` and `c` both become `srv/ABC` in ROS 2; other declaration at M.idsl:1:31 (rename one of them)
        M.idsl:1:60: error[ros-name]: `a` and `SAElement` both become `msg/SAElement` in ROS 2; other declaration at M.idsl:1:47 (rename one of them)
    "#]].assert_eq(&printed.concat());

    let folder = folder(
        "import \"N.idsl\"; module Laser { exception Bad { }; interface I { void go() throws Bad, RoboCompLaser::Bad; }; };",
    );
    let other = "module RoboCompLaser { exception Bad { }; };";
    std::fs::write(folder.path().join("N.idsl"), other).expect("a file");
    let (code, _, err) = rcgen(
        folder.path(),
        &[&EXPORT[..], &["--format", "short"]].concat(),
    );
    assert_eq!(code, 1);
    expect![[r#"
        M.idsl:1:25: error[ros-name]: modules `RoboCompLaser` and `Laser` both become the package `robocomp_laser_msgs` in ROS 2; other module at N.idsl:1:8 (set another package before `module`: `@ros("robot_msgs")`)
        M.idsl:1:71: error[ros-name]: `go` throws two exceptions that become `bad` in ROS 2; first exception at M.idsl:1:43; second exception at N.idsl:1:34
    "#]].assert_eq(&err);
}

/// Structures and operations with standard types of ROS 2.
const STANDARD: &str = include_str!("../ros/Standard.idsl");

#[test]
fn annotated_structures_become_types_of_ros() {
    assert_eq!(findings(&["check", "M.idsl"], STANDARD, 0), "");
    let folder = folder(STANDARD);
    let (code, out, err) = rcgen(folder.path(), &EXPORT);
    assert_eq!((code, err.as_str()), (0, ""));
    expect![[r#"
        create out/robocomp_m_msgs/CMakeLists.txt
        create out/robocomp_m_msgs/msg/Own.msg
        create out/robocomp_m_msgs/msg/Text.msg
        create out/robocomp_m_msgs/package.xml
    "#]]
    .assert_eq(&out);
    let own = std::fs::read_to_string(folder.path().join("out/robocomp_m_msgs/msg/Own.msg"));
    assert!(
        own.expect("a file")
            .ends_with("\nsensor_msgs/LaserScan scan\n")
    );
    let library = library(&folder.path().join("M.idsl"));
    let names: Vec<String> = library
        .interfaces
        .iter()
        .enumerate()
        .flat_map(|(at, interface)| {
            let id = rc_idsl::model::InterfaceId(at);
            let library = &library;
            interface.operations.iter().map(move |operation| {
                let topic = ros::names::topic_type(library, id, operation);
                let service = ros::names::service_type(library, id, operation);
                format!("{}: {topic} {service}", operation.name.text)
            })
        })
        .collect();
    expect![[r#"
        newScan: sensor_msgs/msg/LaserScan robocomp_m_msgs/srv/PubNewScan
        say: std_msgs/msg/String robocomp_m_msgs/srv/PubSay
        tell: std_msgs/msg/String robocomp_m_msgs/srv/PubTell
        clock: rosgraph_msgs/msg/Clock robocomp_m_msgs/srv/PubClock
        nothing: std_msgs/msg/Empty robocomp_m_msgs/srv/PubNothing
        add: robocomp_m_msgs/msg/CallsAdd example_interfaces/srv/AddTwoInts
        trigger: robocomp_m_msgs/msg/CallsTrigger std_srvs/srv/Trigger
        reset: robocomp_m_msgs/msg/CallsReset std_srvs/srv/Empty
        on: robocomp_m_msgs/msg/CallsOn std_srvs/srv/SetBool
        go: std_msgs/msg/Empty std_srvs/srv/Empty"#]]
    .assert_eq(&names.join("\n"));
}

#[test]
fn mismatches_with_types_of_ros_are_rejected() {
    let with = |of: &str| {
        format!(
            "module M {{ @ros(\"builtin_interfaces/msg/Time\") struct Time {{ int sec; uint32 nanosec; }}; {of} }};"
        )
    };
    let all = [
        with(
            "interface I { @ros(\"std_srvs/srv/SetBool\") bool on(bool data, out bool success); };",
        ),
        with("@ros(\"sensor_msgs/LaserScan\") struct S { int x; };"),
        with("@ros(\"sensor_msgs/msg/LaserScn\") struct S { int x; };"),
        with("@ros(\"std_srvs/srv/Empty\") struct S { };"),
        with("@ros(\"geometry_msgs/msg/Point\") struct P { double x; double y; };"),
        with("@ros(\"geometry_msgs/msg/Point\") struct P { double x; float y; double zed; };"),
        with(
            "struct Header { Time stamp; string frame_id; }; @ros(\"sensor_msgs/msg/Temperature\") struct T { Header header; double temperature; double variance; };",
        ),
        with("@ros(\"sensor_msgs/msg/LaserEcho\") struct E { sequence<float, 8> echoes; };"),
        with("@ros(\"std_msgs/msg/Header\") struct H { Time stamp; string<64> frame_id; };"),
        with("@ros(\"shape_msgs/msg/Plane\") struct P { sequence<double, 4> coef; };"),
        with("@ros(\"std_msgs/msg/Int32\") struct P { @optional int data; };"),
        with("@ros(\"std_msgs/msg/Empty\") struct P { int data; };"),
        with(
            "interface I { @ros(\"std_msgs/msg/String\") query string get(); @ros(\"std_srvs/srv/Empty\") query string give(); };",
        ),
        with("interface I { @ros(\"std_srvs/srv/Empty\") publish go(); };"),
        with("interface I { @ros(\"Trigger\") query go(); };"),
        with(
            "interface I { @ros(\"std_srvs/srv/Empty\") @ros(\"std_srvs/srv/Trigger\") query go(); };",
        ),
        with("exception E { }; interface I { @ros(\"std_srvs/srv/Empty\") query go() throws E; };"),
        with(
            "@ros(\"a/msg/B\") @ros(\"a/msg/C\") struct S { int x; }; @ros(3) struct T { int x; }; @ros(\"a\") enum F { f };",
        ),
        "@ros(\"std_msgs\") module M { };".to_owned(),
        "@ros(\"MyMsgs\") module M { };".to_owned(),
    ];
    let printed: Vec<String> = all
        .iter()
        .map(|idsl| findings(&["check", "M.idsl"], idsl, 1))
        .collect();
    expect![[r#"
        M.idsl:1:138: error[ros-mismatch]: the return value is `bool` in ROS 2, but `std_srvs/srv/SetBool` has `string message` (write `string message`)
        M.idsl:1:95: error[ros-type]: invalid name of a message `sensor_msgs/LaserScan` (did you mean `sensor_msgs/msg/LaserScan`?)
        M.idsl:1:95: error[ros-type]: `sensor_msgs` has no `msg/LaserScn` (did you mean `sensor_msgs/msg/LaserScan`?)
        M.idsl:1:95: error[ros-type]: expected a message for struct `S`, found a service (write the name of a message such as `sensor_msgs/msg/LaserScan`)
        M.idsl:1:129: error[ros-mismatch]: struct `P` has 2 members, but `geometry_msgs/msg/Point` has 3 fields (declare float64 x; float64 y; float64 z)
        M.idsl:1:149: error[ros-mismatch]: `y` is `float32 y` in ROS 2, but `geometry_msgs/msg/Point` has `float64 y` (write `float64 y`)
        M.idsl:1:159: error[ros-mismatch]: `zed` is `float64 zed` in ROS 2, but `geometry_msgs/msg/Point` has `float64 z` (write `float64 z`)
        M.idsl:1:192: error[ros-mismatch]: `header` is `robocomp_m_msgs/Header header` in ROS 2, but `sensor_msgs/msg/Temperature` has `std_msgs/Header header` (write `Header header` with a struct that has `@ros("std_msgs/msg/Header")`)
        M.idsl:1:154: error[ros-mismatch]: `echoes` is `float32[<=8] echoes` in ROS 2, but `sensor_msgs/msg/LaserEcho` has `float32[] echoes` (write `sequence<float32> echoes`)
        M.idsl:1:152: error[ros-mismatch]: `frame_id` is `string<=64 frame_id` in ROS 2, but `std_msgs/msg/Header` has `string frame_id` (write `string frame_id`)
        M.idsl:1:150: error[ros-mismatch]: `coef` is `float64[<=4] coef` in ROS 2, but `shape_msgs/msg/Plane` has `float64[4] coef` (write `float64 coef[4]`)
        M.idsl:1:142: error[ros-mismatch]: `data` is `int32[<=1] data` in ROS 2, but `std_msgs/msg/Int32` has `int32 data` (write `int32 data`)
        M.idsl:1:124: error[ros-mismatch]: struct `P` has one member, but `std_msgs/msg/Empty` has no field (remove the members)
        M.idsl:1:109: error[ros-type]: expected a service for the call `get`, found a message (write the name of a service such as `std_srvs/srv/Trigger`)
        M.idsl:1:192: error[ros-mismatch]: the response of `give` has one member, but `std_srvs/srv/Empty` has no field (remove the members)
        M.idsl:1:109: error[ros-type]: expected a message for the topic `go`, found a service (write the name of a message such as `std_msgs/msg/String`)
        M.idsl:1:109: error[ros-type]: invalid name of a message or a service `Trigger` (write a name such as `std_msgs/msg/String` for a topic, or `std_srvs/srv/Trigger` for a call)
        M.idsl:1:136: error[ros-type]: duplicate `srv` type of `go`; first used here at M.idsl:1:109
        M.idsl:1:154: error[ros-mismatch]: `go` throws, but `std_srvs/srv/Empty` has no field for exceptions (report errors in `out` parameters)
        M.idsl:1:111: error[annotation-arguments]: duplicate annotation `@ros`; first used here at M.idsl:1:95
        M.idsl:1:144: error[annotation-arguments]: `@ros` takes one string: `@ros("sensor_msgs/msg/LaserScan")`
        M.idsl:1:173: warning[unknown-annotation]: `@ros` is ignored here (move it before a module, a struct or an operation)
        M.idsl:1:6: error[ros-name]: `std_msgs` is a package of ROS 2 (choose a name of your own; annotate single structs of an interface with `@ros`)
        M.idsl:1:6: error[ros-name]: invalid name of a ROS 2 package `MyMsgs` (use lower-case letters, digits and single `_`, and begin with a letter)
    "#]].assert_eq(&printed.concat());
}

#[test]
fn unknown_types_of_ros_are_noted_and_accepted() {
    let idsl = "module M {
        @ros(\"robot_msgs/msg/Arm\") struct Arm { int x; };
        interface I { @ros(\"robot_msgs/srv/Move\") query go(Arm arm); };
        @ros(\"std_mgs/msg/String\") struct Text { string data; };
    };";
    expect![[r#"
        M.idsl:2:14: note[ros-unchecked]: the fields of `robot_msgs/msg/Arm` are unknown and not compared
        M.idsl:3:28: note[ros-unchecked]: the fields of `robot_msgs/srv/Move` are unknown and not compared
        M.idsl:4:14: note[ros-unchecked]: the fields of `std_mgs/msg/String` are unknown and not compared (did you mean `std_msgs/msg/String`?)
    "#]].assert_eq(&findings(&["check", "M.idsl"], idsl, 0));
}

/// A component whose interfaces do not match their annotated types is not generated.
#[test]
fn types_are_checked_at_generation() {
    let folder = folder(
        "module M { @ros(\"geometry_msgs/msg/Point\") struct P { double x; double y; float z; }; interface I { void go(P p); }; };",
    );
    let cdsl =
        "import \"M.idsl\"; Component C { communications { publishes I; }; language rust; };";
    std::fs::write(folder.path().join("C.cdsl"), cdsl).expect("a file");
    let before = files(folder.path());
    let (code, _, err) = rcgen(folder.path(), &["C.cdsl", "--format", "short"]);
    assert_eq!(code, 1, "{err}");
    expect![[r#"
        M.idsl:1:81: error[ros-mismatch]: `z` is `float32 z` in ROS 2, but `geometry_msgs/msg/Point` has `float64 z` (write `float64 z`)
    "#]].assert_eq(&err);
    assert_eq!(changed(&before, &files(folder.path())), [""; 0]);
}

/// Names of ROS are checked only for components that are nodes.
#[test]
fn names_are_checked_for_a_component_that_is_a_node() {
    let folder = folder(
        "module M { struct Data { int x; }; struct D_Ata { int x; }; interface I { void go(Data a, D_Ata b); }; };",
    );
    let cdsl =
        "import \"M.idsl\"; Component C { communications { publishes I; }; language rust; };";
    std::fs::write(folder.path().join("C.cdsl"), cdsl).expect("a file");
    let args = ["C.cdsl", "--dry-run", "--format", "short", "--middleware"];
    let (code, _, err) = rcgen(folder.path(), &[&args[..], &["ros2"]].concat());
    assert_eq!(code, 1, "{err}");
    expect![[r#"
        M.idsl:1:43: error[ros-name]: `Data` and `D_Ata` become `msg/Data` and `msg/DAta` in ROS 2, which differ only in case; other declaration at M.idsl:1:19 (rename one of them)
    "#]].assert_eq(&err);
    let (code, _, err) = rcgen(folder.path(), &[&args[..], &["dds"]].concat());
    assert_eq!((code, err.as_str()), (0, ""));
}

/// `rcgen check` checks names if the component declares ROS 2 or was generated for it.
#[test]
fn names_are_checked_before_generation() {
    let folder = folder("module M { struct Data { int x; }; interface I { void go(Data d); }; };");
    let path = folder.path();
    let write = |name: &str, text: &str| std::fs::write(path.join(name), text).expect("a file");
    let cdsl = |slots: &str| {
        write(
            "C.cdsl",
            &format!(
                "import \"M.idsl\"; Component C {{ communications {{ {slots} }}; language rust; }};"
            ),
        );
    };
    let check = || {
        let (code, _, err) = rcgen(path, &["check", ".", "--format", "short"]);
        (code, err)
    };
    cdsl("publishes I;");
    let (code, _, err) = rcgen(path, &["C.cdsl", "--middleware", "ros2"]);
    assert_eq!(code, 0, "{err}");
    assert_eq!(check(), (0, String::new()));
    write(
        "M.idsl",
        "module M { struct Data { int x; }; struct D_Ata { int x; }; interface I { void go(Data d); }; };",
    );
    // The component was generated for ROS 2.
    let (code, of_node) = check();
    expect![[r#"
        M.idsl:1:43: error[ros-name]: `Data` and `D_Ata` become `msg/Data` and `msg/DAta` in ROS 2, which differ only in case; other declaration at M.idsl:1:19 (rename one of them)
    "#]]
    .assert_eq(&of_node);
    assert_eq!(code, 1);
    // The component is generated for another middleware.
    let (code, _, err) = rcgen(path, &["C.cdsl", "--middleware", "dds"]);
    assert_eq!(code, 0, "{err}");
    assert_eq!(check(), (0, String::new()));
    // A slot that declares ROS 2. The error is reported once, also by generation.
    cdsl("publishes I(ros2);");
    assert_eq!(check(), (1, of_node.clone()));
    for middleware in ["dds", "ros2"] {
        let args = ["C.cdsl", "--format", "short", "--middleware", middleware];
        let (code, _, err) = rcgen(path, &args);
        assert_eq!((code, err.as_str()), (1, of_node.as_str()));
    }
}

fn library(path: &Path) -> rc_idsl::Library {
    let loader = FileLoader::new(&[]);
    let mut sources = SourceMap::new();
    let (library, found) = export::load(path, &mut sources, &loader).expect("a file");
    assert!(!found.has_errors(), "{}", path.display());
    library
}

/// ROS 2's tools accept all bundled interfaces and files with every construct, and the resulting
/// types have the bytes of components.
#[test]
fn rosidl_accepts_every_file_with_the_same_bytes() {
    let Some(rosidl) = rosidl::rosidl("rosidl_accepts_every_file_with_the_same_bytes") else {
        return;
    };
    let interfaces = std::fs::read_dir(Path::new(HERE).join("../../components/interfaces"));
    let interfaces = interfaces.expect("the interfaces").flatten();
    let mut all: Vec<PathBuf> = interfaces
        .map(|file| file.path())
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
    let folder = tempfile::tempdir().expect("a folder");
    let outs = all.iter().map(|path| {
        let out = folder.path().join(path.file_stem().expect("a name"));
        let (idsl, dir) = (path.to_string_lossy(), out.to_string_lossy());
        let args = ["export", &idsl, "--to", "ros2", "--out", &dir];
        let (code, _, err) = rcgen(folder.path(), &args);
        assert_eq!(code, 0, "{idsl}: {err}");
        // A module whose types are all of ROS 2 becomes no package.
        std::fs::create_dir_all(&out).expect("a folder");
        out
    });
    let found = rosidl.read(&outs.collect::<Vec<_>>());
    let mut compared = 0;
    for path in &all {
        let expected = wire::of(&library(path));
        for line in found.lines() {
            let line = line.strip_prefix("bytes ").and_then(|l| l.split_once(": "));
            let Some((name, bytes)) = line else { continue };
            if let Some(expected) = expected.get(name) {
                assert_eq!(bytes, expected, "{}: {name}", path.display());
                compared += 1;
            }
        }
    }
    assert!(compared > 200, "{compared}");
}

/// A program that uses only ROS 2's tools decodes the bytes of `tests/export.rs` with the exported
/// messages: one value of every type.
#[test]
fn ros_messages_decode_samples_of_components() {
    let test = "ros_messages_decode_samples_of_components";
    let Some(dds) = python::interpreter("cyclonedds==11.0.1", test) else {
        return;
    };
    let Some(ros) = python::interpreter("rosbags==0.11.9", test) else {
        return;
    };
    let folder = tempfile::tempdir().expect("a folder");
    let fixtures = Path::new(HERE).join("tests");
    let idsl = fixtures.join("export/Exported.idsl");
    let idsl = idsl.to_string_lossy();
    let args = ["export", &idsl, "--to", "ros2", "--out", "."];
    assert_eq!(rcgen(folder.path(), &args).0, 0);
    let run = |python: &Path, script: &str, args: &[&str], input: Stdio| {
        let mut command = Command::new(python);
        let command = command.arg(fixtures.join(script)).args(args);
        let output = command.current_dir(folder.path()).stdin(input).output();
        let output = output.expect("Python");
        let err = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{err}");
        String::from_utf8(output.stdout).expect("a text")
    };
    let samples = run(dds, "export/stranger.py", &["write"], Stdio::null());
    let read = |sample: &str, message: &str| {
        let mut lines = samples.lines();
        let bytes = lines.find_map(|line| line.strip_prefix(sample)?.strip_prefix(' '));
        let file = folder.path().join(sample);
        std::fs::write(&file, bytes.expect("a sample")).expect("a file");
        let input = std::fs::File::open(&file).expect("a file");
        let message = format!("robocomp_exported_msgs/msg/{message}");
        run(ros, "ros/values.py", &[".", &message], input.into())
    };
    expect![[r#"
        reading: {valid: True, raw: 200, s: -2, i: -70000, l: -1099511627776, f: 0.5, d: -0.1, i8: -128, u16: 65535, u32: 4000000000, u64: 18446744073709551615, frame: 'base/lidar', text: 'größer als 5 €', ranges: [1.0, 2.5, -3.25], mode: 5, balance: -1, origin: {x: 1.5, y: -2.5}, path: [{x: 0.25, y: 1.0}, {x: 0.5, y: 2.0}], places: [{key: 'dock', value: {x: 1.0, y: 2.0}}, {key: 'door', value: {x: 3.0, y: 4.0}}], counts: [{key: 0, value: 1}, {key: 9, value: -1}], count: [7], goal: [], matrix: [1.0, 2.0, 3.0], tags: ['ab', ''], corners: [{x: 0.0, y: 0.0}, {x: 8.0, y: 9.0}], rows: [{data: [1, 2, 3]}, {data: []}, {data: [-1]}], flags: [True, False, True], modes: [9, 0], nothing: {structure_needs_at_least_one_member: 0}, last: 255}
        tail: 77
    "#]].assert_eq(&read("topic", "NewsTold"));
    expect![[r#"
        structure_needs_at_least_one_member: 0
    "#]]
    .assert_eq(&read("empty-topic", "NewsNothing"));
}
