//! Processes that run several components.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use super::language::check;
use super::network::network;
use expect_test::expect;
use rc_ddsl::Deployment;

/// Each process with its components, and what they have from it.
fn processes(deployment: &Deployment) -> String {
    let mut lines = Vec::new();
    for process in &deployment.processes {
        lines.push(process.path.clone());
        for instance in process
            .instances
            .iter()
            .map(|at| &deployment.instances[*at])
        {
            let host = instance.host.map(|(host, _)| &deployment.hosts[host].name);
            lines.push(format!(
                "  {} on {}: {:?} {:?}, cpu {:?}, priority {:?}",
                instance.path,
                host.map_or("this machine", |host| host.text.as_str()),
                instance.restart.policy,
                instance.restart.hung,
                instance.cpu,
                instance.priority.map(|(priority, _)| priority)
            ));
        }
    }
    lines.join("\n")
}

#[test]
fn components_are_in_a_process_by_its_block_or_its_name() {
    let deployment = check(
        "Host robot { address \"10.0.0.2\"; };\n\
         /// Sees.\nProcess eyes { restart on_failure hung 5s; cpu 2; priority 10; host robot; Component a { cdsl \"a\"; priority 20; }; Component b { cdsl \"a\"; cpu 3; }; };\n\
         Component c { cdsl \"c\"; process eyes; };\nComponent d { cdsl \"d\"; process legs; restart always; };\n\
         Component e { cdsl \"e\"; PROCESS legs; };\nComponent alone { cdsl \"e\"; };\nbind c.Laser -> a.Laser;",
        &expect![""],
    );
    assert_eq!(deployment.processes[0].doc, ["Sees."]);
    assert_eq!(
        deployment
            .instances
            .iter()
            .map(|instance| instance.process.as_ref().map_or("", |name| &name.text))
            .collect::<Vec<_>>(),
        ["eyes", "eyes", "eyes", "legs", "legs", ""]
    );
    expect![[r#"
        eyes
          a on robot: OnFailure Some(5s), cpu [2], priority Some(20)
          b on robot: OnFailure Some(5s), cpu [3], priority Some(10)
          c on robot: OnFailure Some(5s), cpu [2], priority Some(10)
        legs
          d on this machine: Always None, cpu [], priority None
          e on this machine: Always None, cpu [], priority None"#]]
    .assert_eq(&processes(&deployment));
}

#[test]
fn a_name_means_the_process_of_the_nearest_block() {
    let deployment = check(
        "Group g { Process own { Component a { cdsl \"a\"; }; }; Component b { cdsl \"b\"; process eyes; }; Component c { cdsl \"c\"; process own; };\n\
         Group h { Component d { cdsl \"d\"; process own; }; Component e { cdsl \"e\"; process here; }; }; };\n\
         Process eyes { }; Component f { cdsl \"f\"; process own; };",
        &expect![""],
    );
    expect![[r#"
        g.own
          g.a on this machine: Never None, cpu [], priority None
          g.c on this machine: Never None, cpu [], priority None
          g.h.d on this machine: Never None, cpu [], priority None
        eyes
          g.b on this machine: Never None, cpu [], priority None
        g.h.here
          g.h.e on this machine: Never None, cpu [], priority None
        own
          f on this machine: Never None, cpu [], priority None"#]]
    .assert_eq(&processes(&deployment));
}

#[test]
fn what_one_process_cannot_have_is_refused() {
    check(
        "Host one { address \"10.0.0.2\"; };\nHost two { address \"10.0.0.3\"; };\nHost same { address \"10.0.0.2\"; };\n\
         Component a { cdsl \"a\"; process p; host one; priority 5; restart always; env { A \"1\"; B \"1\"; }; };\n\
         Component b { cdsl \"b\"; process p; host same; restart always; env { A \"1\"; }; };\n\
         Component c { cdsl \"c\"; process p; host two; priority 6; restart never; env { B \"2\"; }; };\n\
         Component d { cdsl \"d\"; process p; host localhost; executable \"bin/d\"; };\n\
         Component alone { cdsl \"d\"; process q; executable \"bin/d\"; };",
        &expect![[r#"
            n.ddsl:7:41: error[process-on-two-hosts]: process `p` cannot run on two hosts; the other host at n.ddsl:5:41 (give its components one host, or run one of them in another process)
            n.ddsl:7:46: error[process-priorities]: components of process `p` have different priorities, 5 and 6; the other priority at n.ddsl:5:46 (if that is meant, write `priority 6;` into `Process p`, for its threads that say none)
            n.ddsl:7:58: error[process-restarts-twice]: process `p` restarts as a whole, and has two policies; the other policy at n.ddsl:5:58 (write `restart` once, in the block of the process)
            n.ddsl:7:79: error[process-environment]: process `p` has one environment, and two values of `B`; the other value at n.ddsl:5:87
            n.ddsl:8:63: error[process-executable]: `d` has an executable of its own, and cannot be a thread of process `p` (leave `executable` out: the program of a process is built from the crates of its components)
            n.ddsl:9:51: error[process-executable]: `alone` has an executable of its own, and cannot be a thread of process `q` (leave `executable` out: the program of a process is built from the crates of its components)
        "#]],
    );
    check(
        "Process p { host localhost; restart always; priority 1; Component a { cdsl \"a\"; host one; priority 5; restart on_failure; }; Component b { cdsl \"b\"; priority 6; }; };\n\
         Host one { address \"10.0.0.2\"; };",
        &expect![[r#"
            n.ddsl:2:86: error[process-on-two-hosts]: process `p` cannot run on two hosts; the other host at n.ddsl:2:18 (give its components one host, or run one of them in another process)
            n.ddsl:2:103: error[process-restarts-twice]: process `p` restarts as a whole, and has two policies; the other policy at n.ddsl:2:29 (write `restart` once, in the block of the process)
        "#]],
    );
}

#[test]
fn names_of_processes_are_checked() {
    check(
        "Process eyes { };\nProcess Eyes { restart always; restart never; cpu 1024; priority 0; host nowhere; };\n\
         Component eyes { cdsl \"a\"; };\nProcess rcdeploy { Component b { cdsl \"b\"; process other; process more; }; };\n\
         Component c { cdsl \"c\"; process d; };\nGroup d { Component e { cdsl \"e\"; process f; }; Component f { cdsl \"f\"; }; };\n\
         Process a23456789012345678901234567890123456789012345678901234567890123456 { Component g { cdsl \"g\"; }; };",
        &expect![[r#"
            n.ddsl:2:9: error[duplicate-name]: duplicate name `eyes`; the name of a component or a group at n.ddsl:4:11 (choose another name for the process)
            n.ddsl:2:9: warning[empty-process]: process `eyes` has no components
            n.ddsl:3:9: error[duplicate-name]: duplicate name `Eyes`; first declared here at n.ddsl:2:9 (choose names that differ in more than case)
            n.ddsl:3:9: warning[empty-process]: process `Eyes` has no components
            n.ddsl:3:32: error[repeated-clause]: duplicate field `restart`; first used here at n.ddsl:3:16
            n.ddsl:3:51: error[out-of-range]: expected a processor number from 0 to 1023, found the number 1024
            n.ddsl:3:66: error[out-of-range]: expected a priority from 1 to 99, found the number 0
            n.ddsl:5:9: error[reserved-name]: the name `rcdeploy` is reserved for the supervisor
            n.ddsl:5:44: error[repeated-clause]: duplicate clause `process`; first used here at n.ddsl:5:9
            n.ddsl:5:59: error[repeated-clause]: duplicate field `process`; first used here at n.ddsl:5:44
            n.ddsl:5:59: error[repeated-clause]: duplicate clause `process`; first used here at n.ddsl:5:9
            n.ddsl:6:33: error[duplicate-name]: duplicate name `d`; the name of a component or a group at n.ddsl:7:7 (choose another name for the process)
            n.ddsl:7:43: error[duplicate-name]: duplicate name `f`; the name of a component or a group at n.ddsl:7:59 (choose another name for the process)
            n.ddsl:8:9: error[name-too-long]: the name of process `a23456789012345678901234567890123456789012345678901234567890123456` has 66 bytes, but the maximum is 64
        "#]],
    );
}

#[test]
fn errors_in_processes_are_at_their_places() {
    check(
        "Process { };\nProcess eyes { ready 5s; Componet a { cdsl \"a\"; }; restart; Group g { }; Component b { cdsl \"b\" }; }\n\
         Component c { cdsl \"c\"; process; process \"eyes\"; };\nProces legs { };\nProcess arms Component d { cdsl \"d\"; };",
        &expect![[r#"
            n.ddsl:2:9: error[syntax-error]: expected a name, found `{`
            n.ddsl:3:16: error[unknown-field]: expected a field or a component of a process, found `ready` (expected one of `Component`, `host`, `restart`, `cpu`, `priority`)
            n.ddsl:3:26: error[unknown-field]: expected a field or a component of a process, found `Componet` (did you mean `Component`?)
            n.ddsl:3:59: error[syntax-error]: expected a name, found `;`
            n.ddsl:3:61: error[unknown-field]: expected a field or a component of a process, found `Group` (expected one of `Component`, `host`, `restart`, `cpu`, `priority`)
            n.ddsl:3:96: error[missing-semicolon]: expected `;`
            n.ddsl:4:32: error[syntax-error]: expected a name, found `;`
            n.ddsl:4:42: error[syntax-error]: expected a name, found `"`
            n.ddsl:5:1: error[unknown-field]: expected a declaration of a deployment, found `Proces` (did you mean `Process`?)
            n.ddsl:6:14: error[syntax-error]: expected `{`, found `Component`
        "#]],
    );
}

#[test]
fn a_component_with_an_interpreter_shares_no_process() {
    let two = [("a", "implements Laser;"), ("b_python", "requires Laser;")];
    let connections = network(
        "Process eyes { Component a { cdsl \"a\"; }; Component b { cdsl \"b_python\"; }; };",
        &two,
        &expect![[r#"
            n.ddsl:2:53: error[process-interpreter]: `b` needs an interpreter of its own, and cannot be a thread of process `eyes`; the process at n.ddsl:2:9 (run it in a process of its own: leave `process` out of the component)
        "#]],
    );
    expect!["b.Laser -> a.Laser over local"].assert_eq(&connections.join("\n"));
    network(
        "Component a { cdsl \"a\"; };\nComponent b { cdsl \"b_python\"; process alone; };",
        &two,
        &expect![[r#"
            n.ddsl:3:11: error[process-interpreter]: `b` needs an interpreter of its own, and cannot be a thread of process `alone`; the process at n.ddsl:3:40 (run it in a process of its own: leave `process` out of the component)
        "#]],
    );
}

/// Both have a class `SpecificWorker`.
#[test]
fn two_components_in_cpp_share_no_process() {
    let two = [("a_cpp", "implements Laser;"), ("b_cpp", "requires Laser;")];
    network(
        "Process eyes { Component a { cdsl \"a_cpp\"; }; Component b { cdsl \"b_cpp\"; }; };",
        &two,
        &expect![[r#"
            n.ddsl:2:26: error[process-program]: `a` needs a program of its own, and cannot be a thread of process `eyes`; the process at n.ddsl:2:9 (run it in a process of its own: leave `process` out of the component)
            n.ddsl:2:57: error[process-program]: `b` needs a program of its own, and cannot be a thread of process `eyes`; the process at n.ddsl:2:9 (run it in a process of its own: leave `process` out of the component)
        "#]],
    );
}

#[test]
fn components_of_a_process_are_connected_by_their_own_names_and_middlewares() {
    let connections = network(
        "Component r { cdsl \"r\"; process eyes; };\nProcess eyes { Component a { cdsl \"a\"; }; Component b { cdsl \"a\"; middleware dds; }; };\n\
         bind r.Laser -> a.Laser;",
        &[("a", "implements Laser;"), ("r", "requires Laser;")],
        &expect![""],
    );
    expect!["r.Laser -> a.Laser over local"].assert_eq(&connections.join("\n"));
}
