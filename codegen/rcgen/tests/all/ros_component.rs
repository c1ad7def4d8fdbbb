//! `rcgen export FILE.cdsl --to ros2`: the package that `ros2 run` and launch files start.

use crate::folders::rcgen;
use expect_test::expect;
use rc_test_support::python;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

const CDSL: &str =
    "/// Scans the room.\nComponent lidar { Communications { }; language rust; period 20ms; };\n";
const AMENT_CMAKE: &str = include_str!("../ros/ament_cmake.txt");

/// The folder of a component that was generated for a middleware.
fn folder(cdsl: &str, middleware: &str) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("lidar.cdsl"), cdsl).expect("a file");
    let ran = rcgen(folder.path(), &["lidar.cdsl", "--middleware", middleware]);
    assert_eq!(ran.0, 0, "{ran:?}");
    folder
}

fn export(folder: &Path) -> (i32, String, String) {
    rcgen(
        folder,
        &[
            "export",
            "lidar.cdsl",
            "--to",
            "ros2",
            "--out",
            "src",
            "--format",
            "short",
        ],
    )
}

#[test]
fn a_component_is_exported_as_a_package() {
    let folder = folder(CDSL, "ros2");
    let ran = export(folder.path());
    assert_eq!((ran.0, ran.2.as_str()), (0, ""), "{ran:?}");
    let package = folder.path().join("src/lidar");
    let text = |name: &str| std::fs::read_to_string(package.join(name)).expect("a file");
    expect![[r#"
        <!-- Exported by rcgen from lidar.cdsl; rewritten at every export. -->
        <package format="3">
          <name>lidar</name>
          <version>0.1.0</version>
          <description>Scans the room.</description>
          <maintainer email="nobody@example.com">nobody</maintainer>
          <license>unspecified</license>

          <buildtool_depend>ament_cmake</buildtool_depend>
          <exec_depend>launch_ros</exec_depend>
          <exec_depend>launch_xml</exec_depend>

          <export>
            <build_type>ament_cmake</build_type>
          </export>
        </package>
    "#]]
    .assert_eq(&text("package.xml"));
    expect![[r#"
        <!-- Exported by rcgen from lidar.cdsl; rewritten at every export. -->
        <launch>
          <arg name="name" default="lidar" description="The name of the node."/>
          <arg name="namespace" default="/" description="The namespace of the node, its topics and its services."/>
          <arg name="config" default="$(find-pkg-share lidar)/config.toml" description="The configuration."/>
          <node pkg="lidar" exec="lidar" name="$(var name)" namespace="$(var namespace)" output="screen"
                args="--config $(var config)"/>
        </launch>
    "#]]
    .assert_eq(&text("launch/lidar.launch.xml"));
    // The files are written again, and nothing else is overwritten.
    assert_eq!(export(folder.path()).1, "");
    std::fs::write(package.join("package.xml"), "<package/>").expect("to write");
    let ran = export(folder.path());
    assert_eq!(ran.0, 2, "{ran:?}");
    assert!(ran.2.contains("was not written by an export"), "{ran:?}");
}

#[test]
fn what_cannot_run_in_ros_is_refused() {
    let ran = export(folder(CDSL, "dds").path());
    assert_eq!(ran.0, 1, "{ran:?}");
    let expected = "error[not-for-ros]: `lidar` was not generated for ROS 2 (generate it: `rcgen lidar.cdsl --middleware ros2`)";
    assert!(ran.2.contains(expected), "{ran:?}");
    let cdsl = CDSL.replace("Component lidar", "Component std_msgs");
    let ran = export(folder(&cdsl, "ros2").path());
    assert!(
        ran.2
            .contains("error[ros-name]: `std_msgs` is a package of ROS 2"),
        "{ran:?}"
    );
}

/// The build tool of ROS 2 installs the program where `ros2 run` looks, and the files that
/// `find-pkg-share` finds.
#[test]
fn the_build_tool_of_ros_installs_the_package() {
    let test = "the_build_tool_of_ros_installs_the_package";
    let Some(python) = python::wheels("ament-cmake", AMENT_CMAKE, test) else {
        return;
    };
    let folder = folder(CDSL, "ros2");
    assert_eq!(export(folder.path()).0, 0);
    let bin = python.parent().expect("its folder");
    let prefix = bin.parent().expect("the environment");
    let cmake = |args: &[&str]| {
        let path = std::env::var("PATH").unwrap_or_default();
        let mut command = Command::new(bin.join("cmake"));
        command
            .args(args)
            .env("PATH", format!("{}:{path}", bin.display()));
        let output = command.current_dir(folder.path()).output().expect("cmake");
        assert!(output.status.success(), "{output:?}");
    };
    // As colcon does, with a program that is built elsewhere.
    let places = [
        format!("-DCMAKE_PREFIX_PATH={}", prefix.display()),
        "-DCMAKE_INSTALL_PREFIX=install".to_owned(),
        "-DPROGRAM=/bin/true".to_owned(),
    ];
    let [prefix, install, program] = places.each_ref().map(String::as_str);
    cmake(&["-S", "src/lidar", "-B", "build", prefix, install, program]);
    cmake(&["--build", "build"]);
    cmake(&["--install", "build"]);
    let installed = folder.path().join("install");
    for path in [
        "lib/lidar/lidar",
        "share/lidar/launch/lidar.launch.xml",
        "share/lidar/config.toml",
        "share/lidar/package.xml",
        "share/ament_index/resource_index/packages/lidar",
    ] {
        assert!(installed.join(path).exists(), "{path}");
    }
}
