//! Diagnostics and models of `.smdsl` texts.

#![expect(clippy::needless_raw_string_hashes, reason = "expect-test writes them")]

use crate::shown::{read, shown};
use expect_test::{Expect, expect};

/// Checks the diagnostics for a whole file.
fn check(text: &str, expected: &Expect) {
    expected.assert_eq(&read("m.smdsl", text).0);
}

/// Checks the model of a file, and that there are no diagnostics.
fn model(text: &str, expected: &Expect) {
    let (found, machine) = read("m.smdsl", text);
    assert_eq!(found, "");
    expected.assert_eq(&shown(&machine.expect("a machine")));
}

#[test]
fn every_construct_reaches_the_model() {
    model(
        "/// Drives around.\nrover {\n  end_state off;\n  /// Waits.\n  initial_state idle;\n  states\n    /// Moves.\n    drive,\n    dock;\n  transitions {\n    /// Told to go.\n    idle => drive, off;\n    drive => drive, dock; dock => idle;\n  };\n};\n\
         /// Both at once.\n:drive parallel { states wheels, lidar; transitions { wheels => wheels; lidar => lidar; }; };\n\
         :wheels { /** All of them. */ states turn, stop; initial_state go; end_state halted; transition { go => turn,stop; turn => go; stop => halted; }; };\n",
        &expect![[r#"
            rover "Drives around."
              idle initial "Waits."
              drive "Moves.", all of "Both at once."
                wheels, one of
                  go initial
                  turn
                  stop
                  halted end
                lidar
              dock
              off end
            idle => drive, on IdleToDrive "Told to go."
            idle => off, on IdleToOff "Told to go."
            drive => drive, on DriveToDrive
            drive => dock, on DriveToDock
            dock => idle, on DockToIdle
            wheels => wheels, on WheelsToWheels
            lidar => lidar, on LidarToLidar
            go => turn, on GoToTurn
            go => stop, on GoToStop
            turn => go, on TurnToGo
            stop => halted, on StopToHalted
        "#]],
    );
}

#[test]
fn constructs_of_real_files_are_accepted() {
    model(
        "\n/* Change the name\n   with the states. */\n\n m{\r\n\tstates b;\r\n\tinitial_state a;;\r\n\tend_state z;\r\n\ttransitions{\r\n\t\ta => b;\r\n//\t\tb => a;\r\n\t\tb => b,z;\r\n\t};\r\n};;\r\n\n/* ----\n:b parallel{\n} ---- */\n",
        &expect![[r#"
            m
              a initial
              b
              z end
            a => b, on AToB
            b => b, on BToB
            b => z, on BToZ
        "#]],
    );
    // A redundant `;` after a brace, keywords in any case, a block before the block of its parent.
    model(
        "M { Initial_State a; STATES b; TRANSITION { a=>b; } }\n:c Parallel { States d, e; }\n:b { initial_STATE c; }",
        &expect![[r#"
            M
              a initial
              b, one of
                c initial, all of
                  d
                  e
            a => b, on AToB
        "#]],
    );
    // A transition may lead into another block.
    model(
        "m { initial_state a; states b; transitions { a => b, b2; b2 => a; }; };\n:b { initial_state b1; states b2; transitions { b1 => b2; }; };",
        &expect![[r#"
            m
              a initial
              b, one of
                b1 initial
                b2
            a => b, on AToB
            a => b2, on AToB2
            b2 => a, on B2ToA
            b1 => b2, on B1ToB2
        "#]],
    );
}

#[test]
fn keywords_are_valid_names() {
    model(
        "states { initial_state parallel; states states, transitions, initial_state; end_state end_state;\n\
         transitions { parallel => states, transitions; transition => end_state; states => initial_state; initial_state => transition; }; };\n\
         :parallel parallel { states transition; };\n:transitions { initial_state x; };",
        &expect![[r#"
            states
              parallel initial, all of
                transition
              states
              transitions, one of
                x initial
              initial_state
              end_state end
            parallel => states, on ParallelToStates
            parallel => transitions, on ParallelToTransitions
            transition => end_state, on TransitionToEndState
            states => initial_state, on StatesToInitialState
            initial_state => transition, on InitialStateToTransition
        "#]],
    );
}

#[test]
fn errors_outside_clauses() {
    check(
        "",
        &expect![[r#"
            m.smdsl:1:1: error[empty-file]: expected `NAME { … };` with optional `:STATE { … };` blocks, found an empty file
        "#]],
    );
    check(
        "// nothing\n",
        &expect![[r#"
            m.smdsl:1:1: error[empty-file]: expected `NAME { … };` with optional `:STATE { … };` blocks, found an empty file
        "#]],
    );
    check(
        "m { initial_state a; }; /* never\nends",
        &expect![[r#"
            m.smdsl:1:25: error[unclosed-comment]: unterminated block comment (end the comment with `*/`)
        "#]],
    );
    check(
        "m { initial_state a; };\nn { initial_state b; };",
        &expect![[r#"
            m.smdsl:2:1: error[text-after-end]: unexpected text: a file contains one `NAME { … };` with optional `:STATE { … };` blocks
        "#]],
    );
    check(
        "m { initial_state a; }; }",
        &expect![[r#"
            m.smdsl:1:25: error[text-after-end]: unexpected text: a file contains one `NAME { … };` with optional `:STATE { … };` blocks
        "#]],
    );
    check(
        "m {\n initial_state a;\n",
        &expect![[r#"
        m.smdsl:3:1: error[syntax-error]: expected `}`, found the end of the file
    "#]],
    );
    check(
        "m { initial_state a; };\n:a {\n initial_state b;",
        &expect![[r#"
            m.smdsl:3:18: error[syntax-error]: expected `}`, found the end of the file
        "#]],
    );
    check(
        "m\n initial_state a;\n};",
        &expect![[r#"
        m.smdsl:2:2: error[syntax-error]: expected `{`, found `initial_state`
    "#]],
    );
    check(
        "{ initial_state a; };",
        &expect![[r#"
        m.smdsl:1:1: error[syntax-error]: expected a name, found `{`
    "#]],
    );
    check(
        ":a { initial_state b; };",
        &expect![[r#"
        m.smdsl:1:1: error[syntax-error]: expected a name, found `:`
    "#]],
    );
    check(
        "statemachine m { };",
        &expect![[r#"
        m.smdsl:1:14: error[syntax-error]: expected `{`, found `m`
    "#]],
    );
    check(
        "m { };",
        &expect![[r#"
        m.smdsl:1:1: error[no-initial-state]: the machine has no initial state (add `initial_state NAME;`)
    "#]],
    );
}

#[test]
fn a_missing_semicolon_is_one_error_at_its_location() {
    check(
        "m { states b, c // the others\ninitial_state a\nend_state z\ntransitions { a => b, c\n b => c c => z }\n}\n:b parallel { states d }",
        &expect![[r#"
            m.smdsl:1:16: error[missing-semicolon]: expected `;`
            m.smdsl:2:16: error[missing-semicolon]: expected `;`
            m.smdsl:3:12: error[missing-semicolon]: expected `;`
            m.smdsl:4:24: error[missing-semicolon]: expected `;`
            m.smdsl:5:8: error[missing-semicolon]: expected `;`
            m.smdsl:5:15: error[missing-semicolon]: expected `;`
            m.smdsl:7:23: error[missing-semicolon]: expected `;`
        "#]],
    );
}

#[test]
fn syntax_errors_are_reported() {
    check(
        "m {\ninitial_state a;\nstates b c;\nstate d;\ninitial e;\nfinal f;\n:a { initial_state x; };\nend_state;\ninitial_state = a;\n§;\nstates b, ;\n};",
        &expect![[r#"
            m.smdsl:3:10: error[syntax-error]: expected `,` or `;`, found `c`
            m.smdsl:4:1: error[unknown-clause]: expected a clause of a state machine, found `state` (did you mean `states`?)
            m.smdsl:5:1: error[unknown-clause]: expected a clause of a state machine, found `initial` (did you mean `initial_state`?)
            m.smdsl:6:1: error[unknown-clause]: expected a clause of a state machine, found `final` (did you mean `end_state`?)
            m.smdsl:7:1: error[unknown-clause]: expected a clause of a state machine, found `:` (move the block of substates after the machine)
            m.smdsl:8:10: error[syntax-error]: expected a name, found `;`
            m.smdsl:9:15: error[syntax-error]: expected a name, found `=`
            m.smdsl:10:1: error[unknown-clause]: expected a clause of a state machine, found `§` (expected one of `states`, `initial_state`, `end_state`, `transitions`)
            m.smdsl:11:11: error[syntax-error]: expected a name, found `;`
        "#]],
    );
    check(
        "m {\ninitial_state a; states b, c;\ntransitions {\na -> b;\na => ;\n=> b;\na b;\na => b c;\na => b, b => c;\na;\n};\n};",
        &expect![[r#"
            m.smdsl:4:3: error[syntax-error]: expected `=>`, found `-`
            m.smdsl:5:6: error[syntax-error]: expected a name, found `;`
            m.smdsl:6:1: error[syntax-error]: expected a name, found `=`
            m.smdsl:7:3: error[syntax-error]: expected `=>`, found `b`
            m.smdsl:8:8: error[syntax-error]: expected `,` or `;`, found `c`
            m.smdsl:9:11: error[syntax-error]: expected `,` or `;`, found `=`
            m.smdsl:10:2: error[syntax-error]: expected `=>`, found `;`
        "#]],
    );
    check(
        "m { initial_state a; states b; transitions { a => b; }; };\n:a paralel { states c; };\n: { states d; };\n:b { initial_state e; states f; transitions { e => g, F; }; };",
        &expect![[r#"
            m.smdsl:2:4: error[syntax-error]: expected `parallel` or `{`, found `paralel` (did you mean `parallel`?)
            m.smdsl:3:3: error[syntax-error]: expected a name, found `{`
            m.smdsl:4:55: error[unknown-state]: unknown state `F` (did you mean `f`?)
        "#]],
    );
    // A clause with a syntax error may declare the unknown states.
    check(
        "m { initial_state a; states b = c; transitions { a => b, c, A; }; };",
        &expect![[r#"
            m.smdsl:1:31: error[syntax-error]: expected `,` or `;`, found `=`
            m.smdsl:1:61: error[unknown-state]: unknown state `A` (did you mean `a`?)
        "#]],
    );
    check(
        "m { initial_state a; transitons { a => b; b => c; }; };\n:a { initial_state x; };",
        &expect![[r#"
            m.smdsl:1:22: error[unknown-clause]: expected a clause of a state machine, found `transitons` (did you mean `transitions`?)
        "#]],
    );
}

#[test]
fn unknown_states_are_reported() {
    check(
        "m {\ninitial_state idle; states drive;\ntransitions { idle => driev, Drive, park;\nstop => idle; idle => drive; };\n};\n:drvie { initial_state x; };",
        &expect![[r#"
            m.smdsl:3:23: error[unknown-state]: unknown state `driev` (did you mean `drive`?)
            m.smdsl:3:30: error[unknown-state]: unknown state `Drive` (did you mean `drive`?)
            m.smdsl:3:37: error[unknown-state]: unknown state `park`
            m.smdsl:4:1: error[unknown-state]: unknown state `stop`
            m.smdsl:6:2: error[unknown-state]: unknown state `drvie` (did you mean `drive`?)
        "#]],
    );
}

#[test]
fn repeated_states_are_reported() {
    check(
        "m {\ninitial_state a; states b, c, b;\nend_state C;\ntransitions { a => b, c, C; };\n};\n:b {\n initial_state B1; states a, b1;\n transitions { B1 => b1; };\n};",
        &expect![[r#"
            m.smdsl:2:31: error[duplicate-state]: state `b` is declared twice; first declared here at m.smdsl:2:25
            m.smdsl:3:11: error[duplicate-state]: states `c` and `C` differ only in case; first declared here at m.smdsl:2:28
            m.smdsl:7:27: error[duplicate-state]: state `a` is declared twice; first declared here at m.smdsl:2:15
            m.smdsl:7:30: error[duplicate-state]: states `B1` and `b1` differ only in case; first declared here at m.smdsl:7:16
        "#]],
    );
    check(
        "m {\ninitial_state a;\nend_state a;\n};",
        &expect![[r#"
            m.smdsl:3:11: error[duplicate-state]: state `a` is declared twice; first declared here at m.smdsl:2:15
        "#]],
    );
    check(
        "m {\ninitial_state a; end_state z;\nstates a, b, z;\ntransitions { a => b; b => z; };\n};",
        &expect![[r#"
            m.smdsl:3:8: warning[repeated-state]: `a` is already declared as the initial or the end state; declared here at m.smdsl:2:15
            m.smdsl:3:14: warning[repeated-state]: `z` is already declared as the initial or the end state; declared here at m.smdsl:2:28
        "#]],
    );
}

#[test]
fn repeated_clauses_are_reported() {
    check(
        "m {\ninitial_state a; initial_state b, a;\nend_state y, z;\nstates c; States d;\ntransitions { a => c, d; }; transition { a => b; a => y; b => z; };\n};",
        &expect![[r#"
            m.smdsl:2:32: error[second-initial-state]: a block cannot have a second initial state `b`; first declared here at m.smdsl:2:15
            m.smdsl:2:35: error[second-initial-state]: a block cannot have a second initial state `a`; first declared here at m.smdsl:2:15
            m.smdsl:3:14: error[second-end-state]: a block cannot have a second end state `z`; first declared here at m.smdsl:3:11
            m.smdsl:4:11: error[repeated-clause]: duplicate clause `States`; first used here at m.smdsl:4:1
            m.smdsl:5:29: error[repeated-clause]: duplicate clause `transition`; first used here at m.smdsl:5:1
        "#]],
    );
}

#[test]
fn every_block_but_a_parallel_one_has_an_initial_state() {
    check(
        "m { states a, b; transitions { a => b; }; };\n:a { states c; };\n:b { };\n:c parallel { };",
        &expect![[r#"
            m.smdsl:1:1: error[no-initial-state]: the machine has no initial state (add `initial_state NAME;`)
            m.smdsl:2:2: error[no-initial-state]: `a` has no initial state (add `initial_state NAME;`)
            m.smdsl:3:2: error[no-initial-state]: `b` has no initial state (add `initial_state NAME;`)
            m.smdsl:4:2: error[no-states]: `c` has no states
        "#]],
    );
    check(
        "m { initial_state a; };\n:a parallel {\n initial_state b;\n states c;\n end_state d;\n};",
        &expect![[r#"
            m.smdsl:3:2: error[not-in-parallel]: a parallel block cannot have an initial state; parallel because of this keyword at m.smdsl:2:4 (declare the state under `states`: all of its states are entered together)
            m.smdsl:5:2: error[not-in-parallel]: a parallel block cannot have an end state; parallel because of this keyword at m.smdsl:2:4 (declare the state under `states`: it ends when each of its states has ended)
        "#]],
    );
}

#[test]
fn an_end_state_has_no_transitions_or_substates() {
    check(
        "m { initial_state a; end_state z;\ntransitions { a => z;\nz => a; }; };\n:z { initial_state y; };",
        &expect![[r#"
            m.smdsl:3:6: error[transition-from-end-state]: transition out of the end state `z`; declared here at m.smdsl:1:32
            m.smdsl:4:2: error[end-state-with-substates]: end state `z` has substates; declared here at m.smdsl:1:32
        "#]],
    );
}

#[test]
fn blocks_belong_to_one_declared_state() {
    check(
        "m { initial_state a; };\n:a { initial_state b; };\n:a { initial_state c; };",
        &expect![[r#"
            m.smdsl:3:2: error[duplicate-parent]: duplicate block of substates of `a`; first block at m.smdsl:2:2 (merge the blocks)
        "#]],
    );
    check(
        "m { initial_state a; };\n:b { initial_state c; };\n:c { initial_state b; };\n:d { initial_state d; };",
        &expect![[r#"
            m.smdsl:3:2: error[circular-parents]: a state cannot contain itself: `c` inside `b` inside `c`; also this block at m.smdsl:2:2
            m.smdsl:4:2: error[circular-parents]: a state cannot contain itself: `d` inside `d`
        "#]],
    );
}

#[test]
fn the_nesting_of_blocks_is_limited() {
    let mut text = "m { initial_state s0; };\n".to_owned();
    for i in 0..101 {
        text += &format!(":s{i} {{ initial_state s{}; }};\n", i + 1);
    }
    check(
        &text,
        &expect![[r#"
            m.smdsl:101:22: error[nested-too-deep]: states are nested more than 100 levels deep
        "#]],
    );
}

#[test]
fn unreachable_states_are_reported() {
    check(
        "m {\ninitial_state a; states b, c, d, e, f; end_state z;\ntransitions { a => b; b => a; c => c; d => e; e => d; f => z; };\n};\n\
         :b parallel { states b1, b2; };\n:b1 { initial_state b11; states b12; transitions { b11 => b11; }; };\n:c { initial_state c1; states c2; };",
        &expect![[r#"
            m.smdsl:2:28: warning[no-way-in]: no transition leads to state `c`
            m.smdsl:2:31: warning[unreachable-state]: state `d` is not reachable from the initial state
            m.smdsl:2:34: warning[unreachable-state]: state `e` is not reachable from the initial state
            m.smdsl:2:37: warning[no-way-in]: no transition leads to state `f`
            m.smdsl:2:50: warning[unreachable-state]: state `z` is not reachable from the initial state
            m.smdsl:6:33: warning[no-way-in]: no transition leads to state `b12`
        "#]],
    );
    // The other regions of a parallel state are entered with it.
    check(
        "m { initial_state a; states p; transitions { a => p11; }; };\n:p parallel { states p1, p2; };\n:p1 { initial_state p10; states p11; transitions { p11 => p10; }; };\n:p2 { initial_state p21; };",
        &expect![[""]],
    );
    // A state that is entered through a substate does not enter its initial state.
    check(
        "m { initial_state a; states b; transitions { a => b2; }; };\n:b { initial_state b1; states b2; };",
        &expect![[r#"
            m.smdsl:2:20: warning[unreachable-state]: state `b1` is not reachable from the initial state
        "#]],
    );
}

#[test]
fn missing_and_repeated_transitions_are_reported() {
    check(
        "m { initial_state a; states b; };",
        &expect![[r#"
            m.smdsl:1:1: warning[no-transitions]: state machine `m` has no transitions: it stays in its initial state
        "#]],
    );
    check(
        "m { initial_state a; states b; transitions { }; };",
        &expect![[r#"
            m.smdsl:1:1: warning[no-transitions]: state machine `m` has no transitions: it stays in its initial state
        "#]],
    );
    check(
        "m { initial_state a; states b;\ntransitions { a => b, a, b;\na => b; b => b; }; };",
        &expect![[r#"
            m.smdsl:2:26: warning[duplicate-transition]: duplicate transition `a => b`; first declared here at m.smdsl:2:20
            m.smdsl:3:6: warning[duplicate-transition]: duplicate transition `a => b`; first declared here at m.smdsl:2:20
        "#]],
    );
}

#[test]
fn a_text_of_the_other_language_is_named() {
    let scxml = "\n<?xml version=\"1.0\"?>\n<scxml/>";
    let found = read("m.smdsl", scxml).0;
    let expected =
        "m.smdsl:2:1: error[other-format]: expected SMDSL, found SCXML (name the file `m.scxml`)\n";
    assert_eq!(found, expected);
    for text in [
        "m { initial_state a; };",
        "// A machine.\nm { };",
        ":a { };",
    ] {
        let found = read("m.scxml", text).0;
        let expected = "m.scxml:1:1: error[other-format]: expected SCXML, found SMDSL (name the file `m.smdsl`)\n";
        assert_eq!(found, expected);
    }
}
