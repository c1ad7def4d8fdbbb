//! The network of prototypes: which of them convert into each other by one step, and the cheapest
//! way between two of them.

mod notes;

use crate::covariance::{self, Ends};
use crate::edge::convert;
use crate::loss::Bound;
use crate::moving;
use crate::plan::{Cost, Kind, Plan, Step, TRANSFORM};
use crate::refusal::Refusal;
use crate::rotation;
use crate::shape::{MOST, Shape, Shapes};
use crate::spread::Spreads;
use crate::values::Notes;
use notes::{Chain, keeps_axes, numbers, taken_axes};
use rc_formula::{Program, Recorder, Term, is_reserved};
use rc_prototypes::model::{Content, Library, Part, Prototype};
use rc_vocabulary::Primitive;
use std::cell::RefCell;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap, HashMap};
use std::rc::Rc;

/// The prototypes of a library.
pub struct Network<'l> {
    library: &'l Library,
    shapes: Shapes<'l>,
    /// The shape of each prototype.
    known: HashMap<&'l str, Shape>,
    /// The prototypes of each meaning in each domain, in the order of their names.
    by_meaning: BTreeMap<(&'l str, &'l str), Vec<&'l str>>,
    /// The functions of the user from one prototype to another one, in the order of their names.
    functions: BTreeMap<(&'l str, &'l str), Vec<&'l str>>,
    /// The steps that were asked for.
    steps: RefCell<HashMap<(String, String), Result<Rc<Edge>, Refusal>>>,
    /// The steps from each prototype that was on a way: where to among those of its meaning, and the cost.
    neighbours: RefCell<HashMap<&'l str, Rc<[(usize, u64)]>>>,
}

/// The work of one step.
enum StepKind {
    Direct,
    /// By this function of the user.
    Function(String),
    /// Each part by a plan of its own.
    Parts(Vec<Found>),
}

/// A step between two prototypes.
struct Edge {
    way: StepKind,
    notes: Notes,
    cost: Cost,
    /// Whether it keeps relative errors.
    is_scaling: bool,
}

/// The cheapest way: its prototypes, the first one included, and its steps.
struct Found {
    names: Vec<String>,
    edges: Vec<Rc<Edge>>,
}

impl<'l> Network<'l> {
    /// The network of a library whose resolution found no errors.
    pub fn new(library: &'l Library) -> Self {
        let shapes = Shapes::new(library);
        let mut known = HashMap::new();
        let mut by_meaning: BTreeMap<_, Vec<&str>> = BTreeMap::new();
        for prototype in &library.prototypes {
            if shapes.count(&prototype.name) <= MOST
                && let Some(shape) = shapes.shape(&prototype.name, None)
            {
                known.insert(prototype.name.as_str(), shape);
                let meaning = (prototype.domain.as_str(), prototype.semantic.as_str());
                by_meaning.entry(meaning).or_default().push(&prototype.name);
            }
        }
        for names in by_meaning.values_mut() {
            names.sort_unstable();
        }
        let mut functions: BTreeMap<_, Vec<&str>> = BTreeMap::new();
        for conversion in &library.conversions {
            let ends = (conversion.from.as_str(), conversion.to.as_str());
            functions
                .entry(ends)
                .or_default()
                .push(&conversion.function);
        }
        for names in functions.values_mut() {
            names.sort_unstable();
        }
        Self {
            library,
            shapes,
            known,
            by_meaning,
            functions,
            steps: RefCell::default(),
            neighbours: RefCell::default(),
        }
    }

    /// The cheapest plan from one prototype to another one. Of plans with equal costs, it is the
    /// one with fewer steps, and then the one whose prototypes have the first names.
    ///
    /// # Errors
    /// One of them is unknown, they do not mean the same, or no conversion leads from one to the
    /// other.
    pub fn plan(&self, from: &str, to: &str) -> Result<Plan, Refusal> {
        let found = self.find(from, to)?;
        let ends = self.ends(from, to)?;
        let (input, output) = (ends.from.0, ends.to.0);
        let spreads = Spreads::new(ends, &|name| self.shapes.prototype(name));
        let recorder = Recorder::new(input.len() + spreads.len());
        let inputs = self::inputs(&recorder, input);
        let own = spreads.record(&recorder, input.len());
        let mut terms = self.follow(&recorder, &found, &inputs)?;
        let mut of_spreads = Notes::default();
        let meant = input.signed(&inputs);
        terms.extend(spreads.convert((&meant, &own), None, &mut of_spreads)?);
        let given = inputs.iter().chain(own.iter().flatten());
        if !given.eq(&terms) {
            rotation::require_length(input, &inputs)?;
            own.iter().for_each(|own| covariance::require_positive(own));
        }
        let program = recorder.program(&terms);
        let values = recorder.program(terms.get(..output.len()).unwrap_or_default());
        let mut cost = Cost::of(&program, &of_spreads.lost).beyond(Cost::of(&values, &[]));
        let mut notes = Notes::default();
        let mut steps = Vec::new();
        for (edge, name) in found.edges.iter().zip(found.names.iter().skip(1)) {
            cost = cost + edge.cost;
            steps.push(Step {
                to: name.clone(),
                kinds: edge.notes.kinds.iter().copied().collect(),
            });
            notes.then(edge.notes.clone(), edge.is_scaling);
        }
        notes.add(of_spreads);
        let own = format!("{from}_to_{to}");
        if program.functions().any(|function| function == own) {
            return Err(Refusal::Function(own));
        }
        let plan = Plan {
            from: from.to_owned(),
            steps,
            cost,
            lost: notes.lost,
            notes: taken_axes((from, input), (to, output)),
            program,
            transform: 0,
            covariances: spreads.counts(),
            input: numbers(input, spreads.members(0)),
            output: numbers(output, spreads.members(1)),
        };
        self.within_limit(to, plan)
    }

    /// Both ends of a conversion.
    fn ends(&self, from: &str, to: &str) -> Result<Ends<'_, 'l>, Refusal> {
        Ok(Ends {
            from: (self.shape(from)?, self.prototype(from)?),
            to: (self.shape(to)?, self.prototype(to)?),
        })
    }

    /// The plan from one prototype to another one whose frame moves, over the numbers of the first
    /// one and those of a transform. It leads over no other prototype.
    pub(crate) fn moving(&self, from: &str, to: &str) -> Result<Plan, Refusal> {
        self.agree(self.prototype(from)?, self.prototype(to)?)?;
        let ends = self.ends(from, to)?;
        let (input, output) = (ends.from.0, ends.to.0);
        let spreads = Spreads::new(ends, &|name| self.shapes.prototype(name));
        let behind = input.len() + spreads.len();
        let recorder = Recorder::new(behind + TRANSFORM);
        let inputs = self::inputs(&recorder, input);
        let own = spreads.record(&recorder, input.len());
        let places = behind..behind + TRANSFORM;
        let transform = places.map(|at| recorder.input(at, Primitive::F64));
        let transform: Vec<Term> = transform.collect();
        let transform = moving::transform(&transform)?;
        let mut notes = self.notes(from, to, true)?;
        let mut direct = Notes::default();
        // All other changes are those between two frames that are one.
        let aliases = &self.library.aliases;
        let apart = Recorder::new(input.len());
        let of_direct = self::inputs(&apart, input);
        if convert(input, output, aliases, &of_direct, &mut direct).is_ok() {
            notes.kinds.extend(direct.kinds);
        }
        notes.kinds.insert(Kind::Frames);
        let mut of_values = Notes::default();
        let meant = input.signed(&inputs);
        let moved = moving::convert(input, output, (&meant, &transform), &mut of_values)?;
        let mut terms = output.signed(&moved);
        terms.extend(spreads.convert((&meant, &own), Some(&transform), &mut of_values)?);
        of_values.kinds.clear();
        notes.add(of_values);
        rotation::require_length(input, &inputs)?;
        own.iter().for_each(|own| covariance::require_positive(own));
        let program = recorder.program(&terms);
        let plan = Plan {
            from: from.to_owned(),
            steps: vec![Step {
                to: to.to_owned(),
                kinds: notes.kinds.iter().copied().collect(),
            }],
            cost: Cost::of(&program, &notes.lost),
            lost: notes.lost,
            notes: Vec::new(),
            program,
            transform: TRANSFORM,
            covariances: spreads.counts(),
            input: numbers(input, spreads.members(0)),
            output: numbers(output, spreads.members(1)),
        };
        self.within_limit(to, plan)
    }

    /// The plan, unless it loses more than its second prototype allows.
    fn within_limit(&self, to: &str, plan: Plan) -> Result<Plan, Refusal> {
        let limit = self.limit(to)?;
        match (limit, plan.error()) {
            (Some(limit), None) => {
                let lost: Vec<String> = plan.lost.iter().map(ToString::to_string).collect();
                Err(Refusal::Loss(lost.join("; "), limit))
            }
            (Some(limit), Some(error)) if error > limit => {
                Err(Refusal::Loss(format!("{error:.1e} of the value"), limit))
            }
            _ => Ok(plan),
        }
    }

    /// All steps between prototypes of one meaning, with their costs.
    pub fn edges(&self) -> impl Iterator<Item = (&'l str, &'l str, u64)> {
        self.by_meaning.values().flat_map(move |names| {
            names.iter().flat_map(move |from| {
                let others = names.iter().filter(move |to| *to != from);
                others.filter_map(move |to| {
                    let edge = self.edge(from, to).ok()?;
                    Some((*from, *to, edge.cost.total()))
                })
            })
        })
    }

    fn prototype(&self, name: &str) -> Result<&'l Prototype, Refusal> {
        let unknown = || Refusal::Unknown(name.to_owned());
        self.shapes.prototype(name).ok_or_else(unknown)
    }

    fn shape(&self, name: &str) -> Result<&Shape, Refusal> {
        let missing = || match self.shapes.count(name) {
            count if count > MOST => Refusal::TooMany(name.to_owned()),
            _ => Refusal::Unknown(name.to_owned()),
        };
        self.known.get(name).ok_or_else(missing)
    }

    /// Dijkstra's algorithm, over the prototypes of one meaning.
    fn find(&self, from: &str, to: &str) -> Result<Found, Refusal> {
        let (one, other) = (self.prototype(from)?, self.prototype(to)?);
        let ends = (self.shape(from)?.axes(), self.shape(to)?.axes());
        self.agree(one, other)?;
        let meaning = (one.domain.as_str(), one.semantic.as_str());
        let names = self.by_meaning.get(&meaning).map_or(&[][..], Vec::as_slice);
        let place = |name: &str| names.iter().position(|own| *own == name);
        let (Some(start), Some(goal)) = (place(from), place(to)) else {
            return Err(Refusal::NoWay);
        };
        let is_passable = |at: usize| {
            let shape = self.known.get(names[at]);
            at == goal || shape.is_some_and(|shape| keeps_axes(&ends.0, &ends.1, &shape.axes()))
        };
        // Places are in the order of names, so paths compare as their names do.
        let mut open = BinaryHeap::from([Reverse((0_u64, 0_usize, vec![start]))]);
        let mut settled = vec![false; names.len()];
        let mut best: Vec<Option<(u64, usize, Vec<usize>)>> = vec![None; names.len()];
        let mut path = None;
        while let Some(Reverse((cost, steps, way))) = open.pop() {
            let here = *way.last().unwrap_or(&start);
            if std::mem::replace(&mut settled[here], true) {
                continue;
            }
            if here == goal {
                path = Some(way);
                break;
            }
            for (next, added) in self.neighbours(names, here).iter().copied() {
                let longer = (cost + added, steps + 1);
                let is_longer = |(cost, steps, _): &(u64, usize, _)| (*cost, *steps) < longer;
                if settled[next] || best[next].as_ref().is_some_and(is_longer) || !is_passable(next)
                {
                    continue;
                }
                let candidate = (longer.0, longer.1, [&way[..], &[next]].concat());
                if best[next].as_ref().is_none_or(|known| candidate < *known) {
                    best[next] = Some(candidate.clone());
                    open.push(Reverse(candidate));
                }
            }
        }
        let Some(path) = path else {
            // The reason of the direct step says most.
            return Err(self.edge(from, to).err().unwrap_or(Refusal::NoWay));
        };
        let names: Vec<String> = path.iter().map(|at| names[*at].to_owned()).collect();
        let edges = names.windows(2).map(|pair| self.edge(&pair[0], &pair[1]));
        let edges = edges.collect::<Result<Vec<_>, _>>()?;
        Ok(Found { names, edges })
    }

    /// The places of all prototypes among `names` to which one step leads, with its cost.
    fn neighbours(&self, names: &[&'l str], from: usize) -> Rc<[(usize, u64)]> {
        if let Some(known) = self.neighbours.borrow().get(names[from]) {
            return Rc::clone(known);
        }
        let others = names.iter().enumerate().filter(|(to, _)| *to != from);
        let found: Rc<[(usize, u64)]> = others
            .filter_map(|(to, name)| Some((to, self.edge(names[from], name).ok()?.cost.total())))
            .collect();
        let mut all = self.neighbours.borrow_mut();
        all.insert(names[from], Rc::clone(&found));
        found
    }

    /// The cheapest step from one prototype to another one.
    fn edge(&self, from: &str, to: &str) -> Result<Rc<Edge>, Refusal> {
        let ends = (from.to_owned(), to.to_owned());
        if let Some(known) = self.steps.borrow().get(&ends) {
            return known.clone();
        }
        let found = self.new_edge(from, to).map(Rc::new);
        self.steps.borrow_mut().insert(ends, found.clone());
        found
    }

    fn new_edge(&self, from: &str, to: &str) -> Result<Edge, Refusal> {
        self.agree(self.prototype(from)?, self.prototype(to)?)?;
        let direct = self
            .direct(from, to)
            .or_else(|refusal| self.parts(from, to)?.ok_or(refusal));
        let Some(function) = self.functions.get(&(from, to)).and_then(|all| all.first()) else {
            return direct;
        };
        let declared = self.declared(from, to, function)?;
        match direct {
            Ok(direct) if direct.cost.total() <= declared.cost.total() => Ok(direct),
            _ => Ok(declared),
        }
    }

    fn direct(&self, from: &str, to: &str) -> Result<Edge, Refusal> {
        let (one, other) = (self.shape(from)?, self.shape(to)?);
        let recorder = Recorder::new(one.len());
        let mut notes = self.notes(from, to, true)?;
        let inputs = inputs(&recorder, one);
        let aliases = &self.library.aliases;
        let terms = convert(one, other, aliases, &inputs, &mut notes)?;
        Ok(edge(StepKind::Direct, notes, &recorder.program(&terms)))
    }

    fn declared(&self, from: &str, to: &str, function: &str) -> Result<Edge, Refusal> {
        if is_reserved(function) {
            return Err(Refusal::Function(function.to_owned()));
        }
        let mut notes = self.notes(from, to, true)?;
        notes.kinds.insert(Kind::Declared);
        notes.lose(format!("what `{function}` loses"), Bound::None);
        let one = self.shape(from)?;
        let recorder = Recorder::new(one.len());
        let results = self.call(&recorder, function, to, &inputs(&recorder, one))?;
        let program = recorder.program(&results);
        Ok(edge(
            StepKind::Function(function.to_owned()),
            notes,
            &program,
        ))
    }

    fn call<'r>(
        &self,
        recorder: &'r Recorder,
        function: &str,
        to: &str,
        input: &[Term<'r>],
    ) -> Result<Vec<Term<'r>>, Refusal> {
        let values = self.shape(to)?.values();
        let numbers: Vec<_> = values.iter().map(|value| value.number).collect();
        Ok(recorder.call(function, input, &numbers))
    }

    /// A step in which each part is converted by a plan of its own, if both prototypes are composed.
    /// Parts of prototypes with axes are not: the axes hold for the whole.
    fn parts(&self, from: &str, to: &str) -> Result<Option<Edge>, Refusal> {
        let (one, other) = (self.prototype(from)?, self.prototype(to)?);
        let (Content::Parts(own), Content::Parts(wanted)) = (&one.content, &other.content) else {
            return Ok(None);
        };
        if one.axes.is_some() || other.axes.is_some() {
            return Ok(None);
        }
        let mut notes = self.notes(from, to, false)?;
        notes.kinds.insert(Kind::Composition);
        let mut found = Vec::new();
        for part in wanted {
            let missing = || Refusal::Missing(part.name.clone());
            let of = own.iter().find(|own| own.name == part.name);
            let of = of.ok_or_else(missing)?;
            let plan = self.find(&of.prototype, &part.prototype)?;
            let mut own = Notes::default();
            for edge in &plan.edges {
                own.then(edge.notes.clone(), edge.is_scaling);
            }
            notes.add(own);
            found.push(plan);
        }
        let way = StepKind::Parts(found);
        let shape = self.shape(from)?;
        let recorder = Recorder::new(shape.len());
        let terms = self.step(&recorder, from, to, &way, &inputs(&recorder, shape))?;
        let program = recorder.program(&terms);
        Ok(Some(edge(way, notes, &program)))
    }

    /// The prototypes that hold the same values: both, and all parts of both. A part is an
    /// alternative to the whole where the other prototype has no parts.
    fn pairs(
        &self,
        one: &[&'l Prototype],
        other: &[&'l Prototype],
        out: &mut Vec<(Chain<'l>, Chain<'l>)>,
    ) {
        let (Some(own), Some(wanted)) = (one.first().copied(), other.first().copied()) else {
            return;
        };
        out.push((one.to_vec(), other.to_vec()));
        let inner = |part: &Part, whole: &[&'l Prototype]| {
            let part = self.shapes.prototype(&part.prototype)?;
            Some([&[part][..], whole].concat())
        };
        match (&own.content, &wanted.content) {
            (Content::Values { .. }, Content::Values { .. }) => {}
            (Content::Parts(own), Content::Parts(wanted)) => {
                for to in wanted {
                    let from = own.iter().find(|from| from.name == to.name);
                    let from = from.and_then(|from| inner(from, one));
                    if let Some((from, to)) = from.zip(inner(to, other)) {
                        self.pairs(&from, &to, out);
                    }
                }
            }
            (Content::Parts(own), Content::Values { .. }) => {
                for from in own.iter().filter_map(|part| inner(part, one)) {
                    self.pairs(&from, other, out);
                }
            }
            (Content::Values { .. }, Content::Parts(wanted)) => {
                for to in wanted.iter().filter_map(|part| inner(part, other)) {
                    self.pairs(one, &to, out);
                }
            }
        }
    }

    /// Records all steps of a way.
    fn follow<'r>(
        &self,
        recorder: &'r Recorder,
        found: &Found,
        input: &[Term<'r>],
    ) -> Result<Vec<Term<'r>>, Refusal> {
        let mut terms = input.to_vec();
        for (pair, edge) in found.names.windows(2).zip(&found.edges) {
            terms = self.step(recorder, &pair[0], &pair[1], &edge.way, &terms)?;
        }
        Ok(terms)
    }

    /// Records one step.
    fn step<'r>(
        &self,
        recorder: &'r Recorder,
        from: &str,
        to: &str,
        way: &StepKind,
        input: &[Term<'r>],
    ) -> Result<Vec<Term<'r>>, Refusal> {
        let (one, other) = (self.shape(from)?, self.shape(to)?);
        match way {
            StepKind::Direct => {
                let aliases = &self.library.aliases;
                convert(one, other, aliases, input, &mut Notes::default())
            }
            StepKind::Function(function) => self.call(recorder, function, to, input),
            StepKind::Parts(plans) => {
                let Shape::Parts(parts) = other else {
                    return Err(Refusal::NoWay);
                };
                let mut out = Vec::new();
                for ((name, _), plan) in parts.iter().zip(plans) {
                    let missing = || Refusal::Missing(name.clone());
                    let (_, range) = one.part(name).ok_or_else(missing)?;
                    let input = input.get(range).ok_or_else(missing)?;
                    out.extend(self.follow(recorder, plan, input)?);
                }
                Ok(out)
            }
        }
    }
}

fn inputs<'r>(recorder: &'r Recorder, shape: &Shape) -> Vec<Term<'r>> {
    let values = shape.values().into_iter().enumerate();
    values
        .map(|(at, value)| recorder.input(at, value.number))
        .collect()
}

fn edge(way: StepKind, mut notes: Notes, program: &Program) -> Edge {
    if notes.kinds.is_empty() {
        notes.kinds.insert(Kind::Plain);
    }
    let cost = Cost::of(program, &notes.lost);
    Edge {
        way,
        notes,
        cost,
        is_scaling: program.is_scaling(),
    }
}
