//! Evaluation of conditions, and its errors.

use super::*;

#[test]
fn only_equality_needs_no_order() {
    let signs = Comparator::SIGNS.iter();
    let equality: Vec<&str> = signs
        .filter(|(_, comparator)| comparator.is_equality())
        .map(|(sign, _)| *sign)
        .collect();
    assert_eq!(equality, ["==", "!="]);
}

#[test]
fn whole_numbers_are_divided_without_rounding() {
    let large = (1_i128 << 60) + 1;
    let half = over(Number::Int(2 * large), Number::Int(2));
    assert_eq!(half, Ok(Number::Int(large)));
}

#[test]
fn a_time_is_multiplied_by_a_number_from_either_side() {
    let second = || Operand::Time(Number::Int(1_000_000_000));
    let three = || Operand::Number(Number::Int(3));
    for product in [multiply(second(), three()), multiply(three(), second())] {
        let Ok(Operand::Time(Number::Int(ns))) = product else {
            panic!("{product:?}");
        };
        assert_eq!(ns, 3_000_000_000);
    }
    assert!(multiply(second(), second()).is_err());
}

#[test]
fn either_side_may_decide_and_trouble_is_kept() {
    let (yes, no) = (Ok(true), Ok(false));
    let (zero, empty) = (
        Err(EvaluationError::DivisionByZero),
        Err(EvaluationError::EmptyList),
    );
    for (a, b, and, or) in [
        (yes, no, no, yes),
        (yes, yes, yes, yes),
        (no, no, no, no),
        (yes, zero, zero, yes),
        (no, zero, no, zero),
        (no, empty, no, empty),
        (zero, empty, zero, zero),
        (empty, empty, empty, empty),
    ] {
        for (a, b) in [(a, b), (b, a)] {
            let joined = |decisive| {
                let stack = [a, b].map(|side| side.map(Operand::Bool));
                logical(&mut stack.to_vec(), decisive).map(|o| matches!(o, Operand::Bool(true)))
            };
            assert_eq!((joined(false), joined(true)), (and, or), "{a:?} {b:?}");
        }
    }
}

#[test]
fn steps_that_are_no_condition_are_no_panic() {
    for steps in [
        vec![],
        vec![Step::Not],
        vec![Step::Value(Value::Int(1)), Step::Add],
        vec![Step::Value(Value::Int(1))],
        vec![
            Step::Value(Value::Int(1)),
            Step::Value(Value::Bool(true)),
            Step::And,
        ],
        vec![Step::Call(
            Function::Max,
            Reference {
                level: 7,
                path: Vec::new(),
            },
        )],
    ] {
        let condition = Condition { steps };
        assert_eq!(
            condition.holds(&[]),
            Err(EvaluationError::Malformed),
            "{:?}",
            condition.steps
        );
    }
}
