use super::Interpreter;
use crate::{Program, Recorder, Term};
use rc_quantity::Real;
use rc_vocabulary::Primitive;

const INPUTS: usize = 5;

/// Numbers at which signs, zeros and the order of roundings show.
const NUMBERS: [f64; 12] = [
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.1,
    -0.3,
    7.25,
    1e300,
    -1e300,
    1e-310,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

/// Numbers by a linear congruence.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, most: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005);
        self.0 = self.0.wrapping_add(1_442_695_040_888_963_407);
        usize::try_from(self.0 >> 40).expect("24 bits") % most
    }
}

/// A formula of random operations. Sums, products and opposites are the most frequent ones.
fn random(numbers: &mut Numbers) -> Program {
    let recorder = Recorder::new(INPUTS);
    let mut all: Vec<Term<'_>> = (0..INPUTS)
        .map(|at| recorder.input(at, Primitive::F64))
        .collect();
    all.extend([0.0, -0.0, 2.0, -0.7].map(Term::Constant));
    for _ in 0..40 {
        let [one, other, third] = [(); 3].map(|()| all[numbers.below(all.len())]);
        all.push(match numbers.below(20) {
            0..=4 => one + other,
            5..=8 => one - other,
            9..=12 => one * other,
            13..=16 => -one,
            17 => one / other,
            18 => one.angle_over(other),
            _ => one.if_below(other, -one, third),
        });
    }
    let results: Vec<Term<'_>> = (0..8).map(|_| all[numbers.below(all.len())]).collect();
    recorder.program(&results)
}

/// Products within sums, signs that are no operations and another order change no bit, not even the sign of 0.
#[test]
fn results_are_those_of_the_operations_one_by_one() {
    let mut numbers = Numbers(1);
    for round in 0..400 {
        let program = random(&mut numbers);
        let mut interpreter = Interpreter::new(&program).expect("no call");
        let mut output = vec![0.0; interpreter.outputs()];
        for _ in 0..8 {
            let input = [(); INPUTS].map(|()| NUMBERS[numbers.below(NUMBERS.len())]);
            let expected = program.run(&input).expect("numbers");
            interpreter.run(&input, &mut output).expect("numbers");
            for (own, expected) in output.iter().zip(&expected) {
                assert!(
                    own.to_bits() == expected.to_bits() || own.is_nan() && expected.is_nan(),
                    "round {round}: {own:?} {expected:?} for {input:?} of {program:?}"
                );
            }
        }
    }
}
