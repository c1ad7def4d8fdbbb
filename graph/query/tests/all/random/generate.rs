//! Makes random queries of the whole subset, in which every value has a known type.

use super::ast::{Chain, Clause, Direction, EdgePattern, Expr, Match, NodePattern, Project};
use super::world::{KINDS, NAMES, RELATIONS};
use fastrand::Rng;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Type {
    Node,
    Edge,
    /// The edges of a path.
    Path,
    Int,
    Text,
    Bool,
}

#[derive(Default)]
struct Maker {
    /// The names that are in scope.
    scope: Vec<(String, Type)>,
    made: usize,
}

fn one<T: Copy>(all: &[T], random: &mut Rng) -> T {
    all[random.usize(0..all.len())]
}

/// True in one of `of` cases.
fn seldom(of: u32, random: &mut Rng) -> bool {
    random.u32(0..of) == 0
}

fn binary(operator: &'static str, left: Expr, right: Expr) -> Expr {
    Expr::Binary(operator, Box::new(left), Box::new(right))
}

impl Maker {
    fn fresh(&mut self, letter: char) -> String {
        self.made += 1;
        format!("{letter}{}", self.made)
    }

    fn known(&self, kind: Type, random: &mut Rng) -> Option<String> {
        let all: Vec<&String> = self
            .scope
            .iter()
            .filter(|(_, k)| *k == kind)
            .map(|(n, _)| n)
            .collect();
        (!all.is_empty()).then(|| all[random.usize(0..all.len())].clone())
    }

    fn int(&self, depth: u32, random: &mut Rng) -> Expr {
        let node = self.known(Type::Node, random);
        let edge = self.known(Type::Edge, random);
        let path = self.known(Type::Path, random);
        let number = self.known(Type::Int, random);
        match random.u32(0..10) {
            0..3 => node.map_or(Expr::Int(random.i64(0..4)), |name| {
                Expr::Property(name, "x")
            }),
            3 => node.map_or(Expr::Null, |name| Expr::Property(name, "k")),
            4 if edge.is_some() => Expr::Property(edge.unwrap_or_default(), "w"),
            5 if path.is_some() => {
                Expr::Call("size", vec![Expr::Variable(path.unwrap_or_default())])
            }
            4..7 if number.is_some() => Expr::Variable(number.unwrap_or_default()),
            7 if depth > 0 => binary(
                one(&["+", "-", "*"], random),
                self.int(depth - 1, random),
                self.int(depth - 1, random),
            ),
            8 if depth > 0 => match random.u32(0..4) {
                0 => Expr::Call("abs", vec![self.int(depth - 1, random)]),
                1 => Expr::Call("size", vec![self.text(depth - 1, random)]),
                2 => {
                    let (left, right) = (self.int(depth - 1, random), random.i64(1..4));
                    binary(one(&["/", "%"], random), left, Expr::Int(right))
                }
                _ => Expr::Call(
                    "coalesce",
                    vec![self.int(depth - 1, random), self.int(depth - 1, random)],
                ),
            },
            _ => Expr::Int(random.i64(0..4)),
        }
    }

    fn text(&self, depth: u32, random: &mut Rng) -> Expr {
        let node = self.known(Type::Node, random);
        let edge = self.known(Type::Edge, random);
        let text = self.known(Type::Text, random);
        match random.u32(0..8) {
            0..3 if node.is_some() => Expr::Property(node.unwrap_or_default(), "name"),
            3 if edge.is_some() => {
                Expr::Call("type", vec![Expr::Variable(edge.unwrap_or_default())])
            }
            4 if text.is_some() => Expr::Variable(text.unwrap_or_default()),
            5 if depth > 0 => binary(
                "+",
                self.text(depth - 1, random),
                self.text(depth - 1, random),
            ),
            6 if depth > 0 => Expr::Call("toString", vec![self.int(depth - 1, random)]),
            _ => Expr::Text(one(&NAMES, random)),
        }
    }

    fn truth(&self, depth: u32, random: &mut Rng) -> Expr {
        let flag = self.known(Type::Bool, random);
        let order = ["<", "<=", "=", "<>", ">", ">="];
        match random.u32(0..14) {
            0..4 => binary(
                one(&order, random),
                self.int(1, random),
                self.int(1, random),
            ),
            4 => binary(
                one(
                    &["=", "<>", "<", "STARTS WITH", "ENDS WITH", "CONTAINS"],
                    random,
                ),
                self.text(1, random),
                self.text(1, random),
            ),
            5 => {
                let list = (0..random.usize(0..4))
                    .map(|_| self.int(0, random))
                    .collect();
                binary("IN", self.int(1, random), Expr::List(list))
            }
            6 => {
                let list = (0..random.usize(1..3))
                    .map(|_| self.text(0, random))
                    .collect();
                binary("IN", self.text(0, random), Expr::List(list))
            }
            7 => {
                let of = if random.bool() {
                    self.int(1, random)
                } else {
                    self.text(1, random)
                };
                Expr::IsNull(Box::new(of), random.bool())
            }
            8 if flag.is_some() => Expr::Variable(flag.unwrap_or_default()),
            9..12 if depth > 0 => binary(
                one(&["AND", "OR", "XOR"], random),
                self.truth(depth - 1, random),
                self.truth(depth - 1, random),
            ),
            12 if depth > 0 => Expr::Not(Box::new(self.truth(depth - 1, random))),
            13 if seldom(3, random) => {
                if one(&[true, false], random) {
                    Expr::Bool(true)
                } else {
                    Expr::Null
                }
            }
            // The usual condition finds a node by its name.
            _ => match self.known(Type::Node, random) {
                Some(node) => binary(
                    "=",
                    Expr::Property(node, "name"),
                    Expr::Text(one(&NAMES, random)),
                ),
                None => Expr::Bool(random.bool()),
            },
        }
    }

    fn node(&mut self, random: &mut Rng) -> NodePattern {
        let known = self.known(Type::Node, random);
        let variable = match random.u32(0..8) {
            0 => None,
            1..4 if known.is_some() => known,
            _ => {
                let name = self.fresh('n');
                self.scope.push((name.clone(), Type::Node));
                Some(name)
            }
        };
        NodePattern {
            variable,
            kind: seldom(6, random).then(|| one(&KINDS, random)),
            x: seldom(16, random).then(|| random.i64(0..4)),
        }
    }

    fn edge(&mut self, random: &mut Rng) -> EdgePattern {
        let length = seldom(5, random).then(|| {
            let least = random.usize(0..3);
            (least, least + random.usize(0..2))
        });
        // A path without edges would be `*0..0`.
        let length = length.map(|(least, most)| (least, most.max(1)));
        let variable = random.bool().then(|| self.fresh('e'));
        if let Some(name) = &variable {
            let kind = if length.is_some() {
                Type::Path
            } else {
                Type::Edge
            };
            self.scope.push((name.clone(), kind));
        }
        let types = match random.u32(0..4) {
            0 => vec![],
            1 => RELATIONS.to_vec(),
            _ => vec![one(&RELATIONS, random)],
        };
        EdgePattern {
            variable,
            types,
            direction: one(
                &[
                    Direction::Out,
                    Direction::Out,
                    Direction::In,
                    Direction::Both,
                ],
                random,
            ),
            w: (length.is_none() && seldom(20, random)).then(|| random.i64(0..3)),
            length,
        }
    }

    fn pattern(&mut self, optional: bool, random: &mut Rng) -> Match {
        let chains = (0..if seldom(4, random) { 2 } else { 1 }).map(|_| {
            let first = self.node(random);
            let rest = (0..random.usize(0..3)).map(|_| {
                let edge = self.edge(random);
                (edge, self.node(random))
            });
            Chain {
                rest: rest.collect(),
                first,
            }
        });
        let chains = chains.collect();
        Match {
            optional,
            chains,
            condition: seldom(3, random).then(|| self.truth(2, random)),
        }
    }

    fn scalar(&self, random: &mut Rng) -> (Expr, Type) {
        match random.u32(0..6) {
            0..3 => (self.int(2, random), Type::Int),
            3..5 => (self.text(2, random), Type::Text),
            _ => (self.truth(2, random), Type::Bool),
        }
    }

    fn aggregate(&self, random: &mut Rng) -> (Expr, Type) {
        let (of, kind) = self.scalar(random);
        let distinct = seldom(3, random);
        match random.u32(0..7) {
            0 => (Expr::Aggregate("count", false, None), Type::Int),
            1 => (
                Expr::Aggregate("count", distinct, Some(Box::new(of))),
                Type::Int,
            ),
            2 => {
                let of = Some(Box::new(self.int(1, random)));
                (Expr::Aggregate("sum", distinct, of), Type::Int)
            }
            3 if kind != Type::Bool => (Expr::Aggregate("min", false, Some(Box::new(of))), kind),
            4 if kind != Type::Bool => (Expr::Aggregate("max", false, Some(Box::new(of))), kind),
            _ => {
                let of = Some(Box::new(self.int(1, random)));
                (Expr::Aggregate("min", false, of), Type::Int)
            }
        }
    }

    /// The columns of a clause. Only the last one has means and lists, which nothing goes on with.
    fn project(&mut self, is_last: bool, random: &mut Rng) -> Project {
        let mut items: Vec<(Expr, String)> = Vec::new();
        let mut scope = Vec::new();
        let sums = seldom(3, random);
        let mut has_nodes = false;
        if !is_last {
            for (name, kind) in self.scope.clone() {
                // Grouped by nodes, too.
                if matches!(kind, Type::Node | Type::Int) && random.u32(0..3) > 0 {
                    has_nodes |= kind == Type::Node;
                    items.push((Expr::Variable(name.clone()), name.clone()));
                    scope.push((name, kind));
                }
            }
        }
        for _ in 0..random.usize(1..4) {
            let (expr, kind) = self.scalar(random);
            let name = self.fresh('c');
            scope.push((name.clone(), kind));
            items.push((expr, name));
        }
        if sums {
            for _ in 0..random.usize(1..3) {
                let name = self.fresh('c');
                let (expr, kind) = match random.u32(0..4) {
                    0 if is_last => {
                        let of = Some(Box::new(self.int(1, random)));
                        let distinct = seldom(3, random);
                        (
                            Expr::Aggregate(one(&["avg", "collect"], random), distinct, of),
                            Type::Path,
                        )
                    }
                    _ => self.aggregate(random),
                };
                scope.push((name.clone(), kind));
                items.push((expr, name));
            }
            if seldom(3, random) {
                items.retain(|(expr, _)| matches!(expr, Expr::Aggregate(..)));
                scope.retain(|(name, _)| items.iter().any(|(_, known)| known == name));
                has_nodes = false;
            }
        }
        let is_ordered =
            !has_nodes && scope.iter().all(|(_, kind)| *kind != Type::Path) && seldom(3, random);
        let mut order: Vec<(String, bool)> = Vec::new();
        if is_ordered {
            order = items
                .iter()
                .map(|(_, name)| (name.clone(), random.bool()))
                .collect();
            random.shuffle(&mut order);
        }
        self.scope = scope;
        let condition = (!is_last && seldom(3, random)).then(|| self.truth(1, random));
        Project {
            distinct: seldom(5, random),
            items,
            skip: (is_ordered && random.bool()).then(|| random.usize(0..3)),
            limit: (is_ordered && random.bool()).then(|| random.usize(0..6)),
            order,
            condition,
        }
    }
}

/// A random query.
pub(crate) fn query(random: &mut Rng) -> Vec<Clause> {
    let mut maker = Maker::default();
    let optional = seldom(6, random);
    let mut clauses = vec![Clause::Match(maker.pattern(optional, random))];
    for _ in 0..random.usize(0..3) {
        clauses.push(match random.u32(0..3) {
            0 => Clause::With(maker.project(false, random)),
            1 => Clause::Match(maker.pattern(false, random)),
            _ => Clause::Match(maker.pattern(true, random)),
        });
    }
    clauses.push(Clause::Return(maker.project(true, random)));
    clauses
}
