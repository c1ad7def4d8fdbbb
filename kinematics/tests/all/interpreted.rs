//! Solvers run without printed code and without allocation, and change while a loop runs.

use crate::{ARM, load_beside};
use rc_formula::Interpreter;
use rc_kinematics::{Cell, PAYLOAD};
use std::sync::mpsc;

fn cell(solver: &str) -> Cell {
    let text = format!("import \"arm.urdf\";\nKinematics cell {{ solver it {{ {solver} }}; }};");
    let (cell, found) = load_beside(&text, &[("arm.urdf", ARM)]);
    assert_eq!(found, "");
    cell.expect("a cell")
}

/// After a grasp the solver has a payload and one more output from the next cycle on. No cycle allocates.
#[test]
fn a_solver_gains_a_payload_while_its_loop_runs() {
    let (before, after) = (
        cell("efforts;"),
        cell("efforts; pose wrist in base; accelerations; payload part at wrist;"),
    );
    let make = |cell: &Cell| Interpreter::new(&cell.solvers[0].program).expect("no call");
    let mut solver = Box::new(make(&before));
    let (sender, receiver) = mpsc::sync_channel::<Box<Interpreter>>(1);
    let (old_sender, old) = mpsc::sync_channel::<Box<Interpreter>>(1);
    let mut output = [0.0; 64];
    let mut input = [0.0; 12 + PAYLOAD];
    let mut seen = 0;
    for cycle in 0..200_u32 {
        if cycle == 100 {
            // Another thread reads the new text, and makes the new solver.
            let made = make(&after);
            let grasp = std::thread::spawn({
                let sender = sender.clone();
                move || sender.send(Box::new(made))
            });
            grasp.join().expect("it ends").expect("received");
        }
        for (at, number) in input.iter_mut().enumerate() {
            *number = (f64::from(cycle) * 0.01
                + 0.7 * f64::from(u32::try_from(at).expect("small")))
            .sin();
        }
        let mut cycle_of = || {
            if let Ok(next) = receiver.try_recv() {
                let gone = std::mem::replace(&mut solver, next);
                old_sender.try_send(gone).expect("room");
            }
            let (taken, given) = (solver.inputs(), solver.outputs());
            solver.run(&input[..taken], &mut output[..given])
        };
        let mut ran = Ok(());
        let counted = allocation_counter::measure(|| ran = cycle_of());
        ran.expect("numbers");
        assert_eq!(counted.count_total, 0, "cycle {cycle}");
        let of = if cycle < 100 { &before } else { &after };
        let program = &of.solvers[0].program;
        let expected = program.run(&input[..program.inputs()]).expect("numbers");
        // The same operations in the same order: equal bits.
        assert_eq!(output[..expected.len()], expected);
        seen = expected.len();
    }
    assert_eq!(seen, 3 + 16 + 3);
    assert!(
        old.try_recv().is_ok(),
        "the old solver ends outside the loop"
    );
}
