//! The steps of a formula: its operations, put together and in an order that an interpreter is quick with.

use crate::program::{Operand, Operation, Program};

/// The kind of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Add,
    Subtract,
    Multiply,
    Divide,
    Sine,
    Cosine,
    Other,
    /// `a * b + c * d`
    ProductAndProduct,
    /// `a * b - c * d`
    ProductLessProduct,
}

/// How many kinds there are.
const KINDS: usize = 9;

impl Kind {
    fn of(operation: &Operation) -> Self {
        match operation {
            Operation::Add => Self::Add,
            Operation::Subtract => Self::Subtract,
            Operation::Multiply => Self::Multiply,
            Operation::Divide => Self::Divide,
            Operation::Sine => Self::Sine,
            Operation::Cosine => Self::Cosine,
            _ => Self::Other,
        }
    }

    /// How long its result takes, beside that of others.
    fn time(self) -> usize {
        match self {
            Self::Add | Self::Subtract | Self::Multiply => 2,
            Self::ProductAndProduct | Self::ProductLessProduct => 3,
            Self::Divide => 4,
            Self::Sine | Self::Cosine | Self::Other => 8,
        }
    }

    fn is_short_sum(self) -> bool {
        matches!(self, Self::Add | Self::Subtract | Self::Multiply)
    }

    pub(super) fn is_long(self) -> bool {
        matches!(self, Self::ProductAndProduct | Self::ProductLessProduct)
    }
}

/// An operation with the products and the signs that it computes, too.
pub(super) struct Step {
    pub(super) kind: Kind,
    /// The node that it computes. Opposites of nodes have numbers behind those of all nodes.
    pub(super) node: usize,
    pub(super) operands: Vec<Operand>,
}

impl Step {
    /// The same step as one of this kind: its own one, or a sum of products.
    fn of(mut self, kind: Kind) -> Self {
        if self.kind == kind {
            return self;
        }
        self.operands = match (self.kind, self.operands.as_slice()) {
            (Kind::Add, [one, other]) => vec![*one, ONE, *other, ONE],
            (Kind::Subtract, [one, other]) => vec![*one, ONE, *other, MINUS_ONE],
            (Kind::Multiply, [one, other]) => vec![*one, *other, NOTHING, ONE],
            _ => self.operands,
        };
        self.kind = kind;
        self
    }
}

/// A value, or its opposite.
#[derive(Clone, Copy)]
struct Signed {
    is_negative: bool,
    operand: Operand,
}

const ONE: Operand = Operand::Constant(1.0_f64.to_bits());

const MINUS_ONE: Operand = Operand::Constant((-1.0_f64).to_bits());
/// What changes no sum: 0 would change the sign of another one.
const NOTHING: Operand = Operand::Constant((-0.0_f64).to_bits());

/// The most steps of a kind that are computed as sums of products: a run of their own takes longer.
const FEW: usize = 2;

/// The formula while its steps are found.
struct Steps<'p> {
    program: &'p Program,
    /// What each node is. Opposites are no steps where a sum or a product has them: a sign is exact.
    values: Vec<Signed>,
    /// The step of each node, then those of opposites.
    found: Vec<Option<Step>>,
    /// The opposite of each node, where another step needs it.
    opposites: Vec<Option<usize>>,
}

impl Steps<'_> {
    fn value(&self, operand: Operand) -> Signed {
        match operand {
            Operand::Node(at) => self.values[at],
            Operand::Constant(_) => Signed {
                is_negative: false,
                operand,
            },
        }
    }

    /// An operand with its sign.
    fn plain(&mut self, operand: Operand) -> Operand {
        let Signed {
            is_negative,
            operand,
        } = self.value(operand);
        match operand {
            Operand::Constant(bits) if is_negative => {
                Operand::Constant((-f64::from_bits(bits)).to_bits())
            }
            Operand::Node(at) if is_negative => {
                let count = self.found.len();
                let opposite = *self.opposites[at].get_or_insert(count);
                if opposite == count {
                    self.found.push(Some(Step {
                        kind: Kind::Multiply,
                        node: opposite,
                        operands: vec![operand, MINUS_ONE],
                    }));
                }
                Operand::Node(opposite)
            }
            _ => operand,
        }
    }

    /// The step of a node, and whether the node is its opposite.
    fn step(&mut self, at: usize) -> (Kind, Vec<Operand>, bool) {
        let program = self.program;
        let node = &program.nodes()[at];
        let kind = Kind::of(&node.operation);
        match (kind, node.operands.as_slice()) {
            (Kind::Multiply | Kind::Divide, [one, other]) => {
                let (one, other) = (self.value(*one), self.value(*other));
                let is_negative = one.is_negative != other.is_negative;
                (kind, vec![one.operand, other.operand], is_negative)
            }
            (Kind::Add | Kind::Subtract, [first, second]) => {
                let (one, mut other) = (self.value(*first), self.value(*second));
                other.is_negative ^= kind == Kind::Subtract;
                match (one.is_negative, other.is_negative) {
                    (false, false) => (Kind::Add, vec![one.operand, other.operand], false),
                    (false, true) => (Kind::Subtract, vec![one.operand, other.operand], false),
                    (true, false) => (Kind::Subtract, vec![other.operand, one.operand], false),
                    // The opposite of their sum has another sign where it is 0.
                    (true, true) => {
                        let one = self.plain(*first);
                        (Kind::Subtract, vec![one, other.operand], false)
                    }
                }
            }
            (_, operands) => {
                let operands = operands.iter().map(|operand| self.plain(*operand));
                (kind, operands.collect(), false)
            }
        }
    }
}

/// The steps of a formula, each after its operands.
pub(super) struct Ordered {
    pub(super) steps: Vec<Step>,
    /// Steps of one kind that do not wait for each other, one after the other, and how many they are.
    pub(super) runs: Vec<(Kind, usize)>,
    /// The outputs of the formula.
    pub(super) results: Vec<Operand>,
}

/// The steps of a formula.
pub(super) fn steps(program: &Program) -> Ordered {
    let nodes = program.nodes();
    let own = |at| Signed {
        is_negative: false,
        operand: Operand::Node(at),
    };
    let mut all = Steps {
        program,
        values: (0..nodes.len()).map(own).collect(),
        found: nodes.iter().map(|_| None).collect(),
        opposites: vec![None; nodes.len()],
    };
    for (at, node) in nodes.iter().enumerate() {
        match (&node.operation, node.operands.as_slice()) {
            (Operation::Input(_), _) => {}
            (Operation::Negate, [of]) => {
                let mut value = all.value(*of);
                value.is_negative ^= true;
                all.values[at] = value;
            }
            _ => {
                let (kind, operands, is_negative) = all.step(at);
                all.values[at].is_negative = is_negative;
                all.found[at] = Some(Step {
                    kind,
                    node: at,
                    operands,
                });
            }
        }
    }
    let results = program.results().iter();
    let results: Vec<Operand> = results.map(|result| all.plain(*result)).collect();
    let (steps, runs) = in_order(with_products(all.found, &results));
    Ordered {
        steps,
        runs,
        results,
    }
}

/// Steps with the products that one sum alone needs.
fn with_products(mut steps: Vec<Option<Step>>, results: &[Operand]) -> Vec<Option<Step>> {
    let mut uses = vec![0_usize; steps.len()];
    let operands = steps.iter().flatten().flat_map(|step| &step.operands);
    for operand in operands.chain(results) {
        if let Operand::Node(at) = operand {
            uses[*at] += 1;
        }
    }
    for at in 0..steps.len() {
        let Some(Step { kind, operands, .. }) = &steps[at] else {
            continue;
        };
        let kind = match kind {
            Kind::Add => Kind::ProductAndProduct,
            Kind::Subtract => Kind::ProductLessProduct,
            _ => continue,
        };
        let product = |operand: &Operand| match operand {
            Operand::Node(at) if uses[*at] == 1 => steps[*at]
                .as_ref()
                .filter(|step| step.kind == Kind::Multiply)
                .map(|step| (*at, step.operands.clone())),
            _ => None,
        };
        let products: Vec<_> = operands.iter().map(product).collect();
        let parts: Vec<usize> = products.iter().flatten().map(|(at, _)| *at).collect();
        if parts.is_empty() {
            continue;
        }
        // A value is its product with 1.
        let factors = products.into_iter().zip(operands);
        let factors = factors.map(|(product, operand)| {
            product.map_or_else(|| vec![*operand, ONE], |(_, factors)| factors)
        });
        let operands = factors.collect::<Vec<_>>().concat();
        for part in parts {
            steps[part] = None;
        }
        steps[at] = Some(Step {
            kind,
            node: at,
            operands,
        });
    }
    steps
}

/// Steps after their operands: always all of a kind that can be computed, and first the kind of the step
/// behind which the longest way to the end begins.
fn in_order(mut steps: Vec<Option<Step>>) -> (Vec<Step>, Vec<(Kind, usize)>) {
    let mut users: Vec<Vec<usize>> = vec![Vec::new(); steps.len()];
    let mut missing = vec![0_usize; steps.len()];
    for (at, step) in steps.iter().enumerate() {
        for operand in step.iter().flat_map(|step| &step.operands) {
            if let Operand::Node(of) = operand
                && steps[*of].is_some()
            {
                users[*of].push(at);
                missing[at] += 1;
            }
        }
    }
    let mut ready: Vec<usize> = (0..steps.len())
        .filter(|at| steps[*at].is_some() && missing[*at] == 0)
        .collect();
    // How long it takes from each step to the last that waits for it. Opposites have numbers above those of their users.
    let mut heights = vec![0_usize; steps.len()];
    let mut order = ready.clone();
    let mut left = missing.clone();
    let mut seen = 0;
    while let Some(at) = order.get(seen).copied() {
        seen += 1;
        for user in &users[at] {
            left[*user] -= 1;
            if left[*user] == 0 {
                order.push(*user);
            }
        }
    }
    for at in order.iter().rev() {
        let above = users[*at].iter().map(|user| heights[*user]);
        let own = steps[*at].as_ref().map_or(0, |step| step.kind.time());
        heights[*at] = above.max().unwrap_or_default() + own;
    }
    let mut by_kind: [Vec<usize>; KINDS] = Default::default();
    // The greatest height of each kind. Steps that wait are not looked at again for each run.
    let mut highest = [0_usize; KINDS];
    let (mut out, mut runs) = (Vec::with_capacity(order.len()), Vec::new());
    loop {
        for (highest, all) in highest.iter_mut().zip(&by_kind) {
            if all.is_empty() {
                *highest = 0;
            }
        }
        for at in ready.drain(..) {
            if let Some(step) = &steps[at] {
                let kind = step.kind as usize;
                highest[kind] = highest[kind].max(heights[at]);
                by_kind[kind].push(at);
            }
        }
        let next = (0..KINDS).max_by_key(|kind| (highest[*kind], by_kind[*kind].len()));
        let next = next.unwrap_or_default();
        let first = by_kind[next].first().and_then(|at| steps[*at].as_ref());
        let Some(mut kind) = first.map(|step| step.kind) else {
            return (out, runs);
        };
        let mut now = std::mem::take(&mut by_kind[next]);
        if kind == Kind::ProductAndProduct || (kind.is_short_sum() && now.len() <= FEW) {
            let mut more = std::mem::take(&mut by_kind[Kind::ProductAndProduct as usize]);
            for other in [Kind::Add, Kind::Subtract, Kind::Multiply] {
                let all = &mut by_kind[other as usize];
                if all.len() <= FEW {
                    more.append(all);
                }
            }
            if !more.is_empty() {
                kind = Kind::ProductAndProduct;
                now.append(&mut more);
            }
        }
        runs.push((kind, now.len()));
        for at in now {
            if let Some(step) = steps[at].take() {
                out.push(step.of(kind));
            }
            for user in &users[at] {
                missing[*user] -= 1;
                if missing[*user] == 0 {
                    ready.push(*user);
                }
            }
        }
    }
}
