//! The meanings of the values at both ends of a connection, as prototypes declare them, and the
//! formula between them.

use crate::end::End;
use rc_conversion::{Formula, Operand, is_frame};
use rc_idsl::model::{Member, TypeId};
use rc_plans::{Kind, Plan, Refusal};
use rc_prototypes::model::{Content, Library, Part, Prototype};
use rc_quantity::Unit;
use std::cell::RefCell;
use std::collections::{BTreeSet, HashMap};
use std::fmt;
use std::ops::Bound;
use std::rc::Rc;

/// The prototype that a member, or `sequence` of a prototype, chooses for a type.
pub(crate) type Chosen<'a> = Option<&'a Prototype>;

/// Several prototypes of one type, of which none is chosen.
pub(crate) struct Ambiguous(pub(crate) Vec<String>);

/// Prototypes of a type of an interface, with or without `sequence`.
fn of_type(end: End<'_>, id: TypeId, is_sequence: bool) -> Vec<&Prototype> {
    if end.prototypes.prototypes.is_empty() {
        return Vec::new();
    }
    let path = end.library.type_path(id);
    let all = end.prototypes.prototypes.iter();
    all.filter(|of| of.sequence.is_some() == is_sequence)
        .filter(|of| of.interface_type() == Some(path.as_str()))
        .filter(|of| !end.prototypes.is_part_of_same(of))
        .collect()
}

/// The prototype of a type at one end.
pub(crate) fn prototype<'a>(
    end: End<'a>,
    id: TypeId,
    chosen: Chosen<'a>,
) -> Result<Option<&'a Prototype>, Ambiguous> {
    let named = end.library.ty(id).prototype.as_ref();
    let named = named.and_then(|name| end.prototypes.prototype(&name.text));
    if let Some(prototype) = chosen.or(named) {
        return Ok(Some(prototype));
    }
    match of_type(end, id, false).as_slice() {
        [] => Ok(None),
        [one] => Ok(Some(one)),
        all => Err(Ambiguous(all.iter().map(|of| of.name.clone()).collect())),
    }
}

/// The prototype that a member of a structure chooses for its type, or for its elements.
pub(crate) fn chosen<'a>(end: End<'a>, whole: Option<TypeId>, member: &Member) -> Chosen<'a> {
    let named = member.prototype.as_ref();
    let named = named.and_then(|name| end.prototypes.prototype(&name.text));
    named.or_else(|| {
        let all = of_type(end, whole?, true);
        let own = |of: &&&Prototype| of.sequence.as_deref() == Some(member.name.text.as_str());
        all.iter().find(own).copied()
    })
}

/// The conversion of a structure.
pub(crate) struct Meaning {
    /// The members of the structure that mean something at an end, by their paths.
    pub(crate) members: BTreeSet<String>,
    from: Vec<String>,
    to: Vec<String>,
    plan: Plan,
    /// `units mm ×1/1000 = m, axes right-ahead-up → ahead-left-up; 6 operations a value`
    pub(crate) what: String,
    /// Whether all numbers stay as they are.
    pub(crate) is_identity: bool,
    /// The code of the finding if the connection does not convert.
    pub(crate) code: &'static str,
    /// The change of frames, if it is one between frames that move.
    pub(crate) change: Option<Change>,
}

/// A change between two frames that move.
pub(crate) struct Change {
    pub(crate) from: FrameOf,
    pub(crate) to: String,
    /// The path of the member with the time.
    pub(crate) stamp: String,
    /// Whether the paths are those of the structure around a sequence of the values.
    pub(crate) of_sequence: bool,
}

/// The frame of values.
pub(crate) enum FrameOf {
    Named(String),
    /// The path of the member with its name.
    Member(String),
}

impl FrameOf {
    fn name(&self) -> Option<&str> {
        match self {
            Self::Named(name) => Some(name),
            Self::Member(_) => None,
        }
    }
}

/// The frame of a prototype: a name, or the path of a member.
fn frame_of(of: &Prototype, end: &str) -> Option<FrameOf> {
    let mut frames = of.frames.iter();
    let (_, text) = frames.find(|(own, _)| own == end)?;
    Some(match text.strip_prefix("member ") {
        Some(path) => FrameOf::Member(path.to_owned()),
        None => FrameOf::Named(text.clone()),
    })
}

/// The frames that a connection changes: from that of the first prototype to the name that the second
/// one has. `None` if they are one, or if a message says to which frame.
fn frames(from: &Prototype, to: &Prototype) -> Option<(FrameOf, String)> {
    let Some(FrameOf::Named(to)) = frame_of(to, "with_respect_to") else {
        return None;
    };
    match frame_of(from, "with_respect_to")? {
        FrameOf::Named(from) if from == to => None,
        from @ (FrameOf::Named(_) | FrameOf::Member(_)) => Some((from, to)),
    }
}

/// Whether a path of these begins with the prefix.
pub(crate) fn has_prefix(paths: &BTreeSet<String>, prefix: &str) -> bool {
    let mut behind = paths.range::<str, _>((Bound::Included(prefix), Bound::Unbounded));
    behind.next().is_some_and(|path| path.starts_with(prefix))
}

/// A prototype of a library, by the number of the library and the name.
type Key = (usize, String);

/// The meanings of structures at both ends. The check of a connection, its plans for messages and
/// for images, and connections between components that import the same files ask for the same
/// pairs; each is planned once.
#[derive(Default)]
pub(crate) struct Meanings {
    /// The numbers of libraries, by address and by content.
    places: RefCell<HashMap<*const Library, usize>>,
    texts: RefCell<HashMap<String, usize>>,
    known: RefCell<HashMap<(Key, Key, bool), Rc<Result<Meaning, NotConverted>>>>,
}

impl Meanings {
    /// The plans between prototypes, also between frames that move if a slot knows where these are.
    /// Both libraries live as long as this.
    pub(crate) fn of(
        &self,
        (sender, from): (End<'_>, &Prototype),
        (receiver, to): (End<'_>, &Prototype),
        moves: bool,
    ) -> Rc<Result<Meaning, NotConverted>> {
        let key = |end: End<'_>, of: &Prototype| (self.number(end.prototypes), of.name.clone());
        let key = (key(sender, from), key(receiver, to), moves);
        if let Some(known) = self.known.borrow().get(&key) {
            return Rc::clone(known);
        }
        let found = Rc::new(meaning((sender, from), (receiver, to), moves));
        self.known.borrow_mut().insert(key, Rc::clone(&found));
        found
    }

    /// The number of a library. Libraries with equal contents have one number.
    fn number(&self, library: &Library) -> usize {
        let place: *const Library = library;
        if let Some(known) = self.places.borrow().get(&place) {
            return *known;
        }
        let mut texts = self.texts.borrow_mut();
        let next = texts.len();
        // Without a text, it shares its number with no other library.
        let text = serde_json::to_string(library).unwrap_or_else(|_| format!("{next} {place:p}"));
        let number = *texts.entry(text).or_insert(next);
        self.places.borrow_mut().insert(place, number);
        number
    }
}

/// Why a structure is not converted.
pub(crate) enum NotConverted {
    Refused(Refusal),
    /// The plan calls this function of the user, or does what no connection can.
    Function(String),
    /// A connection would leave the covariance as it is.
    Covariance,
    /// The prototype with this name does not say when its values were measured.
    Stamp(String),
    /// No plan has a frame with this name.
    FrameName(String),
    /// This composite does not say which members hold its parts.
    Places(String),
}

/// The members with the numbers of a prototype, and with these of its covariances.
fn members(
    end: End<'_>,
    of: &Prototype,
    covariances: &[(String, usize)],
) -> Result<Vec<String>, NotConverted> {
    let members = end.prototypes.members(of, covariances);
    let members = members.ok_or_else(|| NotConverted::Places(of.name.clone()))?;
    Ok(members.into_iter().map(|datum| datum.member).collect())
}

/// `right-ahead-up`, or `right-ahead-up with a body ahead-left-up`
fn directions(library: &Library, of: &Prototype) -> Option<String> {
    let named = |name: Option<&String>| {
        let mut all = library.axes.iter();
        let axes = all.find(|axes| Some(&axes.name) == name)?;
        Some(axes.directions.replace(", ", "-"))
    };
    let axes = named(of.axes.as_ref())?;
    Some(match named(of.body.as_ref()) {
        Some(body) => format!("{axes} with a body {body}"),
        None => axes,
    })
}

/// The plan from one prototype to another one.
fn meaning(
    (sender, from): (End<'_>, &Prototype),
    (receiver, to): (End<'_>, &Prototype),
    moves: bool,
) -> Result<Meaning, NotConverted> {
    let ends = (
        (sender.prototypes, from.name.as_str()),
        (receiver.prototypes, to.name.as_str()),
    );
    let change = match frames(from, to).filter(|_| moves) {
        None => None,
        Some((own, wanted)) => {
            for name in [own.name(), Some(wanted.as_str())].into_iter().flatten() {
                if !is_frame(name) {
                    return Err(NotConverted::FrameName(name.to_owned()));
                }
            }
            let Some(FrameOf::Member(stamp)) = frame_of(from, "stamp") else {
                return Err(NotConverted::Stamp(from.name.clone()));
            };
            Some(Change {
                from: own,
                to: wanted,
                stamp,
                of_sequence: from.sequence.is_some(),
            })
        }
    };
    let plan = if change.is_some() {
        rc_plans::moving(ends.0, ends.1)
    } else {
        rc_plans::between(ends.0, ends.1)
    };
    let plan = plan.map_err(NotConverted::Refused)?;
    if let Some(function) = plan.program.functions().next() {
        return Err(NotConverted::Function(function.to_owned()));
    }
    let (ours, theirs) = (
        members(sender, from, &plan.covariances[0])?,
        members(receiver, to, &plan.covariances[1])?,
    );
    let kinds: BTreeSet<Kind> = plan
        .steps
        .iter()
        .flat_map(|step| &step.kinds)
        .copied()
        .collect();
    let code = if kinds.contains(&Kind::Unit) {
        "unit-mismatch"
    } else if kinds.contains(&Kind::Axes) || kinds.contains(&Kind::Sign) {
        "axes-mismatch"
    } else {
        "meaning-mismatch"
    };
    let axes = directions(sender.prototypes, from).zip(directions(receiver.prototypes, to));
    let mut parts = Vec::new();
    for kind in &kinds {
        match (kind, &axes) {
            (Kind::Unit, _) => parts.push(units((sender, from), (receiver, to))),
            (Kind::Frames, _) => parts.extend(change.as_ref().map(ToString::to_string)),
            (Kind::Axes, Some((own, wanted))) => parts.push(format!("axes {own} → {wanted}")),
            (Kind::Coordinate, _) if !coordinate(from).is_empty() => parts.push(format!(
                "coordinates {} → {}",
                coordinate(from),
                coordinate(to)
            )),
            (kind, _) => parts.push(kind.to_string()),
        }
    }
    let count = plan.cost.operations + plan.cost.functions;
    let plural = if count == 1 { "" } else { "s" };
    let mut what = format!("{}; {count} operation{plural} a value", parts.join(", "));
    for loss in &plan.lost {
        what += &format!("; {loss}");
    }
    for note in &plan.notes {
        what += &format!("; {note}");
    }
    let mut meaning = Meaning {
        members: ours.iter().chain(&theirs).cloned().collect(),
        from: ours,
        to: theirs,
        plan,
        what,
        is_identity: false,
        code,
        change,
    };
    let all: Vec<String> = meaning.members.iter().cloned().collect();
    let formula = meaning.formula(&all, 0);
    let outputs = formula.outputs.iter().zip(0..);
    meaning.is_identity =
        formula.steps.is_empty() && outputs.clone().all(|(of, at)| *of == Operand::Input(at));
    let own = sender.prototypes.covariances(from);
    let wanted = receiver.prototypes.covariances(to);
    let differ = own.iter().any(|one| {
        let mut same = wanted.iter().filter(|other| other.part == one.part);
        same.any(|other| other.covariance != one.covariance)
    });
    let mut all = own.iter().chain(&wanted);
    // Only numbers of arrays have places that a plan knows.
    let stays = all.any(|of| {
        let mut converted = meaning.plan.covariances[0].iter();
        of.covariance.number.is_none() || converted.all(|(part, _)| *part != of.part)
    });
    if stays && (differ || !meaning.is_identity) {
        return Err(NotConverted::Covariance);
    }
    Ok(meaning)
}

fn coordinate(of: &Prototype) -> &str {
    match &of.content {
        Content::Values { coordinate, .. } => coordinate,
        Content::Parts(_) => "",
    }
}

/// The first units that differ: `units mm ×1/1000 = m`.
fn units((sender, from): (End<'_>, &Prototype), (receiver, to): (End<'_>, &Prototype)) -> String {
    let numbers = |end: End<'_>, of| end.prototypes.numbers(of).unwrap_or_default();
    let pairs = numbers(sender, from).into_iter().zip(numbers(receiver, to));
    let mut pairs = pairs.filter_map(|(one, other)| one.unit.zip(other.unit));
    let differing = pairs.find(|(one, other)| one != other);
    let conversion = differing.and_then(|(one, other)| {
        let units = Unit::parse(&one).ok().zip(Unit::parse(&other).ok())?;
        let conversion = units.0.conversion_to(&units.1)?;
        Some(format!("units {one} {conversion} = {other}"))
    });
    conversion.unwrap_or_else(|| "units".to_owned())
}

impl fmt::Display for Change {
    /// `frames lidar → map at member stamp`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.from {
            FrameOf::Named(name) => write!(f, "frames {name} → {}", self.to)?,
            FrameOf::Member(path) => write!(f, "frames of member {path} → {}", self.to)?,
        }
        write!(f, " at member {}", self.stamp)
    }
}

/// A short text for a prototype: `Position (cartesian, x in mm, right-ahead-up)`.
pub(crate) fn described(end: End<'_>, of: &Prototype) -> String {
    let mut words = Vec::new();
    match &of.content {
        Content::Values {
            coordinate, data, ..
        } => {
            words.push(coordinate.clone());
            words.extend(data.iter().find_map(|datum| datum.unit.clone()));
            let opposites = data.iter().filter(|datum| datum.is_opposite);
            words.extend(opposites.map(|datum| format!("{} = -{}", datum.member, datum.symbol)));
        }
        Content::Parts(parts) => {
            let inner = |part: &Part| end.prototypes.prototype(&part.prototype);
            let inner = parts.iter().filter_map(inner);
            words.extend(inner.map(|part| described(end, part)));
        }
    }
    words.extend(directions(end.prototypes, of));
    format!("{} ({})", of.semantic, words.join(", "))
}

impl Meaning {
    /// The formula over the members with these paths, in the order of the message. Members with a
    /// meaning at the sender only stay as they are. A change of frames has this number among those
    /// of the message.
    pub(crate) fn formula(&self, marks: &[String], change: u32) -> Formula {
        let places: HashMap<&str, u32> = marks.iter().map(String::as_str).zip(0..).collect();
        let placed = |paths: &[String]| -> Vec<Option<u32>> {
            let place = |path: &String| places.get(path.as_str()).copied();
            paths.iter().map(place).collect()
        };
        let (from, to) = (placed(&self.from), placed(&self.to));
        self.plan.formula((&from, &to), marks.len(), change)
    }
}
