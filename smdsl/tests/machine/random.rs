//! Random charts, stepped side by side with the algorithm of the standard.

use crate::loading::{Run, model};
use crate::reference::Reference;
use rc_machine::Error;
use std::fmt::Write;

/// A generator of numbers: xorshift.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % bound
    }

    fn chance(&mut self, percent: usize) -> bool {
        self.below(100) < percent
    }

    fn pick<'a, T>(&mut self, of: &'a [T]) -> &'a T {
        &of[self.below(of.len())]
    }
}

const EVENTS: [&str; 6] = ["a", "a.b", "a.b.c", "b", "b.c", "c"];
const DESCRIPTORS: [&str; 11] = [
    "a",
    "a.b",
    "a.*",
    "b",
    "b.c.",
    "c",
    "a.b.c b",
    "*",
    "error",
    "done.state",
    "error.execution",
];
const GUARDS: [&str; 4] = ["g1", "g2", "g3", "g4"];

/// Answers a guard alike throughout a step.
fn guard(name: &str, step: usize) -> bool {
    let seed = name.bytes().map(u64::from).sum::<u64>() + 97 * step as u64;
    Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1).below(3) > 0
}

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Plain,
    Parallel,
    Final,
    Shallow,
    Deep,
}

struct Node {
    kind: Kind,
    parent: Option<usize>,
    children: Vec<usize>,
}

struct Machine {
    random: Random,
    nodes: Vec<Node>,
    top: Vec<usize>,
}

impl Machine {
    fn grow(seed: u64) -> Self {
        let random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        let mut it = Self {
            random,
            nodes: Vec::new(),
            top: Vec::new(),
        };
        let count = 2 + it.random.below(4);
        it.top = (0..count).map(|_| it.node(None, 0)).collect();
        if it.random.chance(60) {
            let end = it.leaf(None, Kind::Final);
            it.top.push(end);
        }
        it
    }

    fn leaf(&mut self, parent: Option<usize>, kind: Kind) -> usize {
        self.nodes.push(Node {
            kind,
            parent,
            children: Vec::new(),
        });
        self.nodes.len() - 1
    }

    fn node(&mut self, parent: Option<usize>, depth: usize) -> usize {
        let at = self.leaf(parent, Kind::Plain);
        if depth < 4 && self.random.chance(60 - 10 * depth) {
            let parallel = self.random.chance(35);
            let count = 1 + self.random.below(3) + usize::from(parallel);
            let mut children: Vec<usize> =
                (0..count).map(|_| self.node(Some(at), depth + 1)).collect();
            if parallel {
                self.nodes[at].kind = Kind::Parallel;
            } else if self.random.chance(40) {
                children.push(self.leaf(Some(at), Kind::Final));
            }
            if self.random.chance(35) {
                let kind = *self.random.pick(&[Kind::Shallow, Kind::Deep]);
                let history = self.leaf(Some(at), kind);
                let place = self.random.below(children.len() + 1);
                children.insert(place, history);
            }
            self.nodes[at].children = children;
        }
        at
    }

    fn is_history(&self, node: usize) -> bool {
        matches!(self.nodes[node].kind, Kind::Shallow | Kind::Deep)
    }

    /// A state inside of `of`, at most the given number of levels deep. No history state if not
    /// allowed.
    fn inside(&mut self, of: usize, history: bool) -> usize {
        let mut at = of;
        loop {
            let children = self.nodes[at].children.clone();
            let all: Vec<usize> = children
                .into_iter()
                .filter(|c| history || !self.is_history(*c))
                .collect();
            if all.is_empty() {
                return at;
            }
            at = *self.random.pick(&all);
            if self.is_history(at) || self.random.chance(40) {
                return at;
            }
        }
    }

    fn targets(&mut self) -> String {
        let any = self.random.below(self.nodes.len());
        let mut targets = vec![any];
        // Sometimes one in each of several regions.
        let parallel = self.nodes[any].kind == Kind::Parallel;
        if parallel && self.random.chance(70) {
            let regions: Vec<usize> = self.nodes[any].children.clone();
            let regions = regions.into_iter().filter(|c| !self.is_history(*c));
            let regions: Vec<usize> = regions.collect();
            targets = regions.into_iter().map(|r| self.inside(r, true)).collect();
        }
        let names: Vec<String> = targets.iter().map(|t| format!("s{t}")).collect();
        names.join(" ")
    }

    fn actions(&mut self) -> String {
        let mut out = String::new();
        for _ in 0..self.random.below(3) {
            let event = *self.random.pick(&EVENTS);
            let id = self.random.below(3);
            let delay = self.random.below(4) * 10;
            match self.random.below(24) {
                0..2 => {
                    let _ = write!(out, "<raise event='{event}'/>");
                }
                2..6 => {
                    let _ = write!(out, "<send event='{event}' id='i{id}' delay='{delay}ms'/>");
                }
                6 => {
                    let _ = write!(out, "<cancel sendid='i{id}'/>");
                }
                7 => out += "<script>fail</script>",
                _ => {
                    let _ = write!(out, "<script>f{}</script>", self.random.below(1000));
                }
            }
        }
        out
    }

    fn transition(&mut self) -> String {
        let mut out = "<transition".to_owned();
        if self.random.chance(95) {
            let _ = write!(out, " event='{}'", self.random.pick(&DESCRIPTORS));
        } else if self.random.chance(80) {
            let _ = write!(out, " cond='{}'", self.random.pick(&GUARDS));
        }
        if !out.contains("cond") && self.random.chance(30) {
            let state = self.random.below(self.nodes.len());
            let guard = *self.random.pick(&GUARDS);
            let cond = if self.random.chance(50) {
                format!("In('s{state}')")
            } else {
                guard.to_owned()
            };
            let _ = write!(out, " cond=\"{cond}\"");
        }
        if self.random.chance(85) || !out.contains('=') {
            let _ = write!(out, " target='{}'", self.targets());
        }
        if self.random.chance(30) {
            out += " type='internal'";
        }
        format!("{out}>{}</transition>", self.actions())
    }

    fn print(&mut self, at: usize, out: &mut String) {
        let kind = self.nodes[at].kind;
        if self.is_history(at) {
            let word = if kind == Kind::Deep {
                "deep"
            } else {
                "shallow"
            };
            let parent = self.nodes[at].parent.expect("it is there");
            let target = self.inside(parent, false);
            let actions = self.actions();
            let _ = writeln!(
                out,
                "<history id='s{at}' type='{word}'><transition target='s{target}'>{actions}</transition></history>"
            );
            return;
        }
        let tag = match kind {
            Kind::Parallel => "parallel",
            Kind::Final => "final",
            _ => "state",
        };
        let _ = writeln!(out, "<{tag} id='s{at}'>");
        let compound = kind == Kind::Plain && !self.nodes[at].children.is_empty();
        if compound && self.random.chance(50) {
            let target = self.inside(at, true);
            let actions = self.actions();
            let _ = writeln!(
                out,
                "<initial><transition target='s{target}'>{actions}</transition></initial>"
            );
        }
        for tag in ["onentry", "onexit"] {
            for _ in 0..self.random.below(3) {
                let _ = writeln!(out, "<{tag}>{}</{tag}>", self.actions());
            }
        }
        if kind != Kind::Final {
            for _ in 0..self.random.below(5) {
                let transition = self.transition();
                let _ = writeln!(out, "{transition}");
            }
        }
        for child in self.nodes[at].children.clone() {
            self.print(child, out);
        }
        let _ = writeln!(out, "</{tag}>");
    }

    fn text(&mut self) -> String {
        let mut out = "<scxml xmlns='http://www.w3.org/2005/07/scxml' version='1.0'>\n".to_owned();
        for at in self.top.clone() {
            self.print(at, &mut out);
        }
        out + "</scxml>\n"
    }
}

/// Coverage of a run of charts.
#[derive(Debug, Default)]
struct Reached {
    ended: usize,
    endless: usize,
    steps: usize,
    taken: usize,
}

fn compare(seed: u64, reached: &mut Reached) {
    let mut machine = Machine::grow(seed);
    let text = machine.text();
    let model = model(&format!("{seed}.scxml"), &text);
    let mut run = Run::new(&model, guard);
    run.host.states = true;
    let mut reference = Reference::new(&model, guard);
    let mut result = run.start().map(|()| true);
    let mut first = true;
    for _ in 0..60 {
        match result {
            Err(Error::TooManyRaised) => return,
            // The reference needs long for these.
            Err(Error::Endless) if reached.endless >= 4 => return,
            _ => {}
        }
        if std::mem::take(&mut first) {
            reference.start();
        } else {
            let there = reference.step();
            assert_eq!(result != Ok(false), there, "seed {seed}\n{text}");
        }
        assert_eq!(result.is_err(), reference.endless, "seed {seed}\n{text}");
        if reference.endless {
            reached.endless += 1;
            return;
        }
        assert_eq!(run.host.trace, reference.trace, "seed {seed}\n{text}");
        assert_eq!(run.active(), reference.active(), "seed {seed}\n{text}");
        assert_eq!(
            run.host.session.has_ended(),
            !reference.running,
            "seed {seed}"
        );
        if !reference.running {
            reached.ended += 1;
            return;
        }
        if machine.random.chance(80) {
            let event = *machine.random.pick(&EVENTS);
            let names = &run.host.session.chart().events;
            if let Some(number) = names.iter().position(|name| name == event) {
                run.host.session.fire(number as u16).expect("it is there");
                reference.external.push_back(event.to_owned());
            }
        }
        let step = run.step();
        reached.steps += 1;
        reached.taken += usize::from(step.is_ok_and(|step| step.is_some_and(|step| step.taken)));
        result = step.map(|step| step.is_some());
    }
}

#[test]
fn random_charts_do_what_the_standard_says() {
    let seeds: u64 =
        std::env::var("CHARTS").map_or(200, |count| count.parse().expect("it is there"));
    let mut reached = Reached::default();
    for seed in 1..=seeds {
        compare(seed, &mut reached);
    }
    println!("{reached:?}");
    // The charts must be such that something happens.
    assert!(reached.taken > 500, "{reached:?}");
    assert!(reached.ended > 5 && reached.endless == 4, "{reached:?}");
}
