//! Adaptors where components have configurations, groups, hosts and simulated time.

use super::converting::with_prototype;
use rc_codegen::FileLoader;
use rc_deploy_network::plan::{Component, Plan};
use rc_deploy_network::{self as network, Overrides, Profile};
use rc_diagnostics::{Format, SourceMap, render};
use rc_test_site::site::{Site, rcdeploy};
use std::fs;
use std::path::Path;

/// The plan of a network beside a mapper in metres and a lidar in millimetres, over DDS, or what is
/// wrong with it.
fn planned(folder: &Path, body: &str) -> Result<Plan, String> {
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, text).expect("a file");
    };
    for (name, role, unit) in [
        ("mapper", "subscribesTo ScanPub(dds) as lidar", "m"),
        ("lidar", "publishes ScanPub(dds) as scan", "mm"),
    ] {
        let idsl = format!(
            "module Scans {{ interface ScanPub {{ publish scan(@unit(\"{unit}\") float x); }}; }};\n"
        );
        write(&format!("{name}/Scans.idsl"), &idsl);
        let cdsl = format!(
            "import \"Scans.idsl\";\nComponent {name} {{ Communications {{ {role}; }}; language rust; }};\n"
        );
        write(&format!("{name}/{name}.cdsl"), &cdsl);
    }
    let config = "[bindings]\nlidar = \"field/scan\"\n[middleware.dds]\ndomain = 7\n";
    write("mapper/etc/config.toml", config);
    write("n.ddsl", &format!("Deployment n\n{{\n{body}\n}};\n"));
    let (mut sources, loader) = (SourceMap::new(), FileLoader::new(&[]));
    let path = folder.join("n.ddsl");
    let loaded = network::load(&path, &Overrides::default(), &mut sources, &loader);
    let (network, found) = loaded.expect("a file");
    if found.has_errors() {
        return Err(render(&sources, &found, Format::Short));
    }
    Ok(network
        .expect("a network")
        .plan(Profile::Dev)
        .expect("a plan"))
}

fn component<'p>(plan: &'p Plan, name: &str) -> &'p Component {
    let mut components = plan.components.iter();
    let found = components.find(|component| component.name == name);
    found.unwrap_or_else(|| panic!("no `{name}` in {plan:?}"))
}

fn has(component: &Component, option: &str, value: &str) {
    let mut options = component.args.windows(2);
    let is_there = options.any(|own| own[0] == option && own[1] == value);
    assert!(is_there, "{option} {value}: {:?}", component.args);
}

#[test]
fn an_adaptor_has_the_addresses_and_settings_of_its_consumer() {
    let folder = tempfile::tempdir().expect("a folder");
    let body = "middleware iceoryx2;\nComponent mapper { cdsl \"mapper/mapper.cdsl\"; };\n\
                external mapper.lidar { cdsl \"lidar/lidar.cdsl\"; convert via process; };";
    let plan = planned(folder.path(), body).expect("a plan");
    let adaptor = component(&plan, "mapper_lidar_adaptor");
    has(adaptor, "--bind", "provider=field/scan");
    has(adaptor, "--set-middleware", "dds.domain=7");
    has(adaptor, "--convert", "provider=0i:f{1/1000}");
    assert_eq!(adaptor.external, ["provider"]);
    let mapper = component(&plan, "mapper");
    has(mapper, "--bind", "lidar=n/mapper_lidar_adaptor/consumer");
    assert!(mapper.external.is_empty());

    // Without a process, the mapper itself converts.
    let plan = planned(folder.path(), &body.replace(" via process", "")).expect("a plan");
    assert_eq!(plan.components.len(), 1);
    has(&plan.components[0], "--bind", "lidar=field/scan");
    has(&plan.components[0], "--convert", "lidar=0i:f{1/1000}");
    assert_eq!(plan.components[0].external, ["lidar"]);
}

#[test]
fn a_program_outside_is_served_at_its_address() {
    let folder = tempfile::tempdir().expect("a folder");
    let body = "middleware iceoryx2;\nComponent lidar { cdsl \"lidar/lidar.cdsl\"; };\n\
                external lidar.scan at \"field/metres\" { cdsl \"mapper/mapper.cdsl\"; convert; };";
    let plan = planned(folder.path(), body).expect("a plan");
    let adaptor = component(&plan, "lidar_lidar_adaptor");
    has(adaptor, "--bind", "provider=n/lidar/scan");
    has(adaptor, "--bind", "consumer=field/metres");
    has(adaptor, "--convert", "provider=0i:f{1/1000}");
    // Without an address, it is that of components that are started by hand.
    let plan = planned(folder.path(), &body.replace(" at \"field/metres\"", "")).expect("a plan");
    has(
        component(&plan, "lidar_lidar_adaptor"),
        "--bind",
        "consumer=n/ScanPub",
    );
}

#[test]
fn a_program_outside_is_served_at_a_free_address() {
    let folder = tempfile::tempdir().expect("a folder");
    let body = "middleware iceoryx2;\nComponent lidar { cdsl \"lidar/lidar.cdsl\"; };\n\
                Component other { cdsl \"lidar/lidar.cdsl\"; };\n";
    let outside = |end: &str, at: &str| {
        format!("external {end}.scan {at} {{ cdsl \"mapper/mapper.cdsl\"; convert; }};\n")
    };
    let refused = |more: &[String]| {
        planned(folder.path(), &format!("{body}{}", more.concat())).expect_err("an error")
    };
    // The adaptor would hear itself.
    let said = refused(&[outside("lidar", "at \"n/lidar/scan\"")]);
    assert!(
        said.contains("error[bad-address]: `lidar_lidar_adaptor.consumer` would serve"),
        "{said}"
    );
    assert!(said.contains("address of `lidar.scan`"), "{said}");
    // Nothing says that both are meant to be one topic.
    let said = refused(&[outside("lidar", ""), outside("other", "")]);
    assert!(
        said.contains("`n/ScanPub`, which is the address of `lidar_lidar_adaptor.consumer`"),
        "{said}"
    );
    let at = "at \"field/metres\"";
    let both = [outside("lidar", at), outside("other", at)].concat();
    assert!(planned(folder.path(), &format!("{body}{both}")).is_ok());
}

#[test]
fn a_group_is_ready_when_its_adaptors_are() {
    let folder = tempfile::tempdir().expect("a folder");
    let body = "middleware iceoryx2;\nGroup arm { Component mapper { cdsl \"mapper/mapper.cdsl\"; }; export lidar; };\n\
                Component lidar { cdsl \"lidar/lidar.cdsl\"; after arm; middleware dds { domain 7; }; };\n\
                bind arm.lidar -> lidar.scan { convert via process; };";
    let plan = planned(folder.path(), body).expect("a plan");
    assert_eq!(
        component(&plan, "lidar").after,
        ["arm.mapper", "arm.mapper_lidar_adaptor"]
    );
}

#[test]
fn an_adaptor_runs_on_the_host_of_its_consumer() {
    let folder = tempfile::tempdir().expect("a folder");
    let body = "middleware iceoryx2;\nHost robot { address \"10.0.0.2\"; };\n\
                Component mapper { cdsl \"mapper/mapper.cdsl\"; host robot; };\n\
                Component lidar { cdsl \"lidar/lidar.cdsl\"; middleware dds { domain 7; }; };\n\
                bind mapper.lidar -> lidar.scan { convert via process; };";
    let plan = planned(folder.path(), body).expect("a plan");
    let adaptor = component(&plan, "mapper_lidar_adaptor");
    assert_eq!(adaptor.host, component(&plan, "mapper").host);
    assert_eq!(adaptor.host.as_ref().expect("a host").name, "robot");
    assert!(adaptor.executable.ends_with("rcforward"), "{adaptor:?}");
}

/// A simulator in its axes, and a monitor in others, in simulated time.
fn in_lockstep(name: &str, block: &str) -> String {
    let site = Site::new(name);
    Site::executable("rcforward");
    site.monitor("trace", 100);
    with_prototype(&site, "simulator", "right, ahead, up");
    with_prototype(&site, "pose_monitor", "ahead, left, up");
    site.write(
        "clock.toml",
        "[parameters]\nstep = \"50ms\"\nrate = 0.0\nlimit = \"500ms\"\n",
    );
    let there = Site::components().display().to_string();
    let program = |name: &str| Site::executable(name).display().to_string();
    site.write(
        "patrol.ddsl",
        &format!(
            "Deployment {}\n{{\n    time simulated by clock;\n    \
             Component simulator {{ cdsl \"simulator/simulator.cdsl\"; executable \"{}\"; parameters {{ map \"{there}/maps/house.map\"; }}; }};\n    \
             Component monitor {{ cdsl \"pose_monitor/pose_monitor.cdsl\"; executable \"{}\"; config \"monitor.toml\"; }};\n    \
             Component avoider {{ cdsl \"{there}/avoider/avoider.cdsl\"; after monitor; }};\n    \
             Component clock {{ cdsl \"{there}/clock/clock.cdsl\"; config \"clock.toml\"; after monitor; }};\n    \
             bind monitor.FullPoseEstimationPub -> simulator.FullPoseEstimationPub {{ {block} }};\n}};\n",
            site.network,
            program("simulator"),
            program("pose_monitor"),
        ),
    );
    let mut up = site.command(&rcdeploy());
    up.args(["up", "--detach", "--profile", "dev"])
        .arg(site.ddsl());
    let up = site.run(up);
    assert_eq!(up.code, 0, "{up:?}");
    site.await_end_of("monitor");
    let trace = fs::read_to_string(site.path("trace")).expect("the trace");
    let down = site.rcdeploy(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
    trace
}

/// The poses of a trace, without their times.
fn poses(trace: &str) -> Vec<&str> {
    let lines = trace.lines();
    let poses = lines.filter_map(|line| Some(line.split_once(',')?.1));
    poses.collect()
}

#[test]
fn an_adaptor_in_lockstep_repeats_exactly() {
    let first = in_lockstep("adapted_time", "convert via process;");
    assert_eq!(first.lines().count(), 100);
    assert_eq!(first, in_lockstep("adapted_again", "convert via process;"));
    // The monitor by itself gets the same poses.
    let alone = in_lockstep("adapted_alone", "convert;");
    assert_eq!(poses(&first), poses(&alone));
}

/// The peer of an external slot may be a component that is started by hand, without an address and
/// without `--convert`.
#[test]
fn a_component_that_is_started_by_hand_gets_converted_poses() {
    let site = Site::new("adapted_hand");
    Site::executable("rcforward");
    let config = site.monitor("trace", 5);
    with_prototype(&site, "simulator", "right, ahead, up");
    with_prototype(&site, "pose_monitor", "ahead, left, up");
    let there = Site::components().display().to_string();
    site.write(
        "patrol.ddsl",
        &format!(
            "Deployment {}\n{{\n    \
             Component simulator {{ cdsl \"simulator/simulator.cdsl\"; executable \"{}\"; parameters {{ map \"{there}/maps/house.map\"; }}; }};\n    \
             external simulator.FullPoseEstimationPub {{ cdsl \"pose_monitor/pose_monitor.cdsl\"; convert; }};\n}};\n",
            site.network,
            Site::executable("simulator").display(),
        ),
    );
    let up = site.rcdeploy(&["up", "--detach", "--profile", "dev"], true);
    assert_eq!(up.code, 0, "{up:?}");
    let options = ["--network", &site.network, "--config", &config];
    let monitor = site.component("pose_monitor", &options);
    assert_eq!(monitor.code, 0, "{monitor:?}");
    let asked = [
        "echo",
        &site.network,
        "simulator.FullPoseEstimationPub.newFullPose",
        "--once",
        "--format",
        "json",
    ];
    let sent = site.rcdeploy(&asked, false);
    let sent: serde_json::Value = serde_json::from_str(&sent.stdout).expect("JSON");
    let sent = ["y", "x"].map(|name| sent["value"]["pose"][name].as_f64().expect("a number"));
    let trace = fs::read_to_string(site.path("trace")).expect("a trace");
    let last: Vec<f64> = trace
        .lines()
        .last()
        .expect("a pose")
        .split(',')
        .filter_map(|number| number.parse().ok())
        .collect();
    // The robot stands: nobody drives it.
    assert!(sent[0].abs() > 1.0 && sent[1].abs() > 1.0, "{sent:?}");
    assert!((last[1] - sent[0]).abs() < 1e-2, "{trace} {sent:?}");
    assert!((last[2] + sent[1]).abs() < 1e-2, "{trace} {sent:?}");
    let down = site.rcdeploy(&["down", &site.network], false);
    assert_eq!(down.code, 0, "{down:?}");
    site.assert_nothing_left();
}
