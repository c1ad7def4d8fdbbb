//! The parser. Errors become diagnostics, and parsing continues after the skipped input.

mod cells;

use self::cells::{closed, mount};
use crate::ast::{
    Choice, File, Import, Inverse, Kinematics, MotionPart, Output, OutputKind, Payload, Posture,
    Quantity, Rate, Setting, SettingKind, Side, Solver, Subject,
};
use pest::iterators::Pair;
use rc_diagnostics::{Diagnostic, Diagnostics, SourceId, SourceMap, Span};
use rc_syntax::{Literal, Name, ParseContext};

#[allow(
    unreachable_pub,
    reason = "pest makes `Rule` public, and it names its parser"
)]
#[derive(pest_derive::Parser)]
#[grammar = "common.pest"]
#[grammar = "grammar.pest"]
pub struct Grammar;

/// The contents of a solver.
const OUTPUTS: [&str; 27] = [
    "pose",
    "jacobian",
    "velocity",
    "acceleration",
    "efforts",
    "mass_matrix",
    "accelerations",
    "loop_errors",
    "loop_jacobian",
    "loop_forces",
    "closed_positions",
    "closed_velocities",
    "joint",
    "actuator",
    "holding",
    "passive",
    "gravity",
    "payload",
    "inverse",
    "within",
    "tolerance",
    "iterations",
    "restarts",
    "seed",
    "damped",
    "null",
    "period",
];

/// Parses one `.kdsl` text.
pub fn parse(sources: &SourceMap, source: SourceId) -> (File, Diagnostics) {
    let mut reader = ParseContext::new(sources, source);
    let mut file = File::default();
    for pair in reader.file::<Rule>().into_iter().flatten() {
        match pair.as_rule() {
            Rule::import => {
                let (mut named, mut alias) = (None, None);
                for part in pair.into_inner() {
                    match part.as_rule() {
                        Rule::string => named = Some(reader.string(&part)),
                        Rule::alias => {
                            let mut inside = part.into_inner();
                            let name = inside.find(|part| part.as_rule() == Rule::name);
                            alias = name.map(|name| reader.name(&name));
                        }
                        Rule::semicolon => reader.semicolon(&part),
                        _ => {}
                    }
                }
                file.imports
                    .extend(named.map(|file| Import { file, alias }));
            }
            Rule::kinematics => file.kinematics = Some(kinematics(&mut reader, pair)),
            Rule::trailing => reader.trailing(&pair),
            _ => {}
        }
    }
    (file, reader.finish())
}

fn kinematics(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Kinematics {
    let mut kinematics = Kinematics {
        name: Name::new("", r.span(&pair)),
        choices: Vec::new(),
        mounts: Vec::new(),
        loops: Vec::new(),
        postures: Vec::new(),
        solvers: Vec::new(),
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => kinematics.name = r.name(&part),
            Rule::solver => kinematics.solvers.push(solver(r, part)),
            Rule::grounding => kinematics.choices.extend(choice(r, part)),
            Rule::mount => kinematics.mounts.extend(mount(r, part)),
            Rule::ring => kinematics.loops.push(closed(r, part)),
            Rule::posture => kinematics.postures.push(posture(r, part)),
            Rule::skipped => {
                let rule = match r.first_word(&part).text.to_lowercase().as_str() {
                    "posture" => Rule::posture,
                    "math" | "scalars" | "lengths" | "matrices" | "frames" => Rule::grounding,
                    "fixed" | "planar" | "floating" | "spherical" => Rule::mount,
                    "loop" => Rule::ring,
                    _ => Rule::solver,
                };
                let words = [
                    "solver",
                    "posture",
                    "fixed",
                    "planar",
                    "floating",
                    "spherical",
                    "loop",
                    "math",
                    "scalars",
                    "lengths",
                    "matrices",
                    "frames",
                ];
                skipped(r, &part, &words, rule);
            }
            _ => {}
        }
    }
    kinematics
}

fn choice(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Choice> {
    let span = trimmed(r, &pair);
    let (mut subject, mut word) = (None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::kw_math => subject = Some(Subject::Math),
            Rule::kw_scalars => subject = Some(Subject::Scalars),
            Rule::kw_lengths => subject = Some(Subject::Lengths),
            Rule::kw_matrices => subject = Some(Subject::Matrices),
            Rule::kw_frames => subject = Some(Subject::Frames),
            Rule::name => word = Some(r.name(&part)),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    let (subject, word) = subject.zip(word)?;
    Some(Choice {
        span,
        subject,
        word,
    })
}

/// Reports unreadable text: a word that begins no declaration, or the rest after one.
fn skipped(r: &mut ParseContext<'_>, pair: &Pair<'_, Rule>, words: &[&'static str], rule: Rule) {
    let first = r.first_word(pair);
    if words.contains(&first.text.to_lowercase().as_str()) {
        r.report_skipped(pair, rule);
        return;
    }
    let message = format!("expected {}, found `{}`", list(words), first.text);
    let diagnostic = Diagnostic::error("unknown-declaration", first.span, message);
    r.found
        .push(diagnostic.suggest(&first.text, words.iter().copied()));
}

fn list(words: &[&str]) -> String {
    let words: Vec<String> = words.iter().map(|word| format!("`{word}`")).collect();
    match words.as_slice() {
        [one] => one.clone(),
        all => format!("one of {}", all.join(", ")),
    }
}

fn solver(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Solver {
    let mut solver = Solver {
        name: Name::new("", r.span(&pair)),
        doc: r.doc(&pair),
        outputs: Vec::new(),
        gravity: Vec::new(),
        payloads: Vec::new(),
        holding: Vec::new(),
        passive: Vec::new(),
        inverses: Vec::new(),
        settings: Vec::new(),
        is_whole: true,
    };
    for part in pair.into_inner() {
        let span = trimmed(r, &part);
        match part.as_rule() {
            Rule::name => solver.name = r.name(&part),
            Rule::motion => {
                let kind = motion(r, part);
                solver
                    .outputs
                    .extend(kind.map(|kind| Output { span, kind }));
            }
            Rule::whole => {
                let kind = whole(r, part);
                solver
                    .outputs
                    .extend(kind.map(|kind| Output { span, kind }));
            }
            Rule::driven => {
                let kind = driven(r, part);
                solver
                    .outputs
                    .extend(kind.map(|kind| Output { span, kind }));
            }
            Rule::gravity => {
                let mut numbers = Vec::new();
                for inside in part.into_inner() {
                    match inside.as_rule() {
                        Rule::number => numbers.push(r.literal(&inside)),
                        Rule::semicolon => r.semicolon(&inside),
                        _ => {}
                    }
                }
                solver.gravity.push((span, numbers));
            }
            Rule::payload => {
                let (mut name, mut link) = (None, None);
                for inside in part.into_inner() {
                    match inside.as_rule() {
                        Rule::name => name = Some(r.name(&inside)),
                        Rule::frame => link = frame(r, inside),
                        Rule::semicolon => r.semicolon(&inside),
                        _ => {}
                    }
                }
                let both = name.zip(link);
                solver
                    .payloads
                    .extend(both.map(|(name, link)| Payload { span, name, link }));
            }
            Rule::holding => {
                let (mut joints, mut is_passive) = (Vec::new(), false);
                for inside in part.into_inner() {
                    match inside.as_rule() {
                        Rule::kw_passive => is_passive = true,
                        Rule::frame => joints.extend(frame(r, inside)),
                        Rule::semicolon => r.semicolon(&inside),
                        _ => {}
                    }
                }
                let all = if is_passive {
                    &mut solver.passive
                } else {
                    &mut solver.holding
                };
                all.push((span, joints));
            }
            Rule::inverse => solver.inverses.extend(inverse(r, part, span)),
            Rule::setting => {
                let kind = setting(r, part);
                solver
                    .settings
                    .extend(kind.map(|kind| Setting { span, kind }));
            }
            Rule::skipped => {
                let rule = match r.first_word(&part).text.to_lowercase().as_str() {
                    "inverse" => Rule::inverse,
                    "within" => Rule::within,
                    "tolerance" => Rule::tolerance,
                    "iterations" => Rule::iterations,
                    "restarts" => Rule::restarts,
                    "seed" => Rule::seed,
                    "damped" => Rule::damped,
                    "null" => Rule::null,
                    "period" => Rule::period,
                    "gravity" => Rule::gravity,
                    "efforts" | "mass_matrix" | "accelerations" | "loop_errors"
                    | "loop_jacobian" | "loop_forces" | "closed_positions"
                    | "closed_velocities" => Rule::whole,
                    "joint" | "actuator" => Rule::driven,
                    "holding" | "passive" => Rule::holding,
                    "payload" => Rule::payload,
                    _ => Rule::motion,
                };
                solver.is_whole = false;
                skipped(r, &part, &OUTPUTS, rule);
            }
            _ => {}
        }
    }
    solver
}

/// A span without the `;`, the blanks and the comments at its end.
fn trimmed(r: &ParseContext<'_>, pair: &Pair<'_, Rule>) -> Span {
    let span = r.span(pair);
    let end = r.trivia.end_of_token_before(span.end);
    let text = r.text.get(span.start..end).unwrap_or_default();
    let end = span.start + text.trim_end_matches(';').len();
    Span::new(span.source, span.start, end.max(span.start))
}

fn frame(r: &ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Name> {
    let part = pair.into_inner().next()?;
    Some(match part.as_rule() {
        Rule::string => r.string(&part),
        _ => r.name(&part),
    })
}

fn motion(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<OutputKind> {
    let (mut what, mut frames, mut expressed) = (None, Vec::new(), None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::kw_pose => what = Some(MotionPart::Pose),
            Rule::form => what = Some(MotionPart::Quaternion),
            Rule::kw_jacobian => what = Some(MotionPart::Jacobian),
            Rule::kw_velocity => what = Some(MotionPart::Velocity),
            Rule::kw_acceleration => what = Some(MotionPart::Acceleration),
            Rule::frame => frames.extend(frame(r, part)),
            Rule::expressed => {
                let mut inside = part.into_inner();
                let named = inside.find(|part| part.as_rule() == Rule::frame);
                expressed = named.and_then(|named| frame(r, named));
            }
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    let mut frames = frames.into_iter();
    Some(OutputKind::Motion {
        what: what?,
        tip: frames.next()?,
        base: frames.next()?,
        expressed,
    })
}

fn posture(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Posture {
    let mut posture = Posture {
        name: Name::new("", r.span(&pair)),
        joints: Vec::new(),
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => posture.name = r.name(&part),
            Rule::coordinate => {
                let (mut joint, mut place) = (None, None);
                for inside in part.into_inner() {
                    match inside.as_rule() {
                        Rule::frame => joint = frame(r, inside),
                        Rule::quantity => place = quantity(r, inside),
                        Rule::semicolon => r.semicolon(&inside),
                        _ => {}
                    }
                }
                posture.joints.extend(joint.zip(place));
            }
            Rule::skipped => r.report_skipped(&part, Rule::coordinate),
            _ => {}
        }
    }
    posture
}

fn quantity(r: &ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Quantity> {
    let (mut number, mut unit) = (None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::number => number = Some(r.literal(&part)),
            Rule::unit => unit = frame(r, part),
            _ => {}
        }
    }
    Some(Quantity {
        number: number?,
        unit,
    })
}

fn inverse(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>, span: Span) -> Option<Inverse> {
    let OutputKind::Motion {
        what,
        tip,
        base,
        expressed,
    } = motion(r, pair)?
    else {
        return None;
    };
    Some(Inverse {
        span,
        what,
        tip,
        base,
        expressed,
    })
}

fn setting(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<SettingKind> {
    let mut kind = None;
    for part in pair.into_inner() {
        let rule = part.as_rule();
        if rule == Rule::semicolon {
            r.semicolon(&part);
            continue;
        }
        let (mut names, mut numbers, mut quantities) = (Vec::new(), Vec::new(), Vec::new());
        for inside in part.into_inner() {
            match inside.as_rule() {
                Rule::name => names.push(r.name(&inside)),
                Rule::number => numbers.push(r.literal(&inside)),
                Rule::quantity => quantities.extend(quantity(r, inside)),
                Rule::gain => {
                    let inside = inside.into_inner();
                    let given = inside.filter(|part| part.as_rule() == Rule::number);
                    numbers.extend(given.map(|part| r.literal(&part)));
                }
                _ => {}
            }
        }
        let number: Option<Literal> = numbers.into_iter().next();
        let (name, mut quantities) = (names.into_iter().next(), quantities.into_iter());
        kind = match rule {
            Rule::within => Some(SettingKind::Within),
            Rule::tolerance => quantities
                .next()
                .zip(quantities.next())
                .map(|(near, turned)| SettingKind::Tolerance(near, turned)),
            Rule::iterations => number.map(SettingKind::Iterations),
            Rule::restarts => number.map(SettingKind::Restarts),
            Rule::seed => name.map(SettingKind::Seed),
            Rule::damped => number.map(SettingKind::Damped),
            Rule::null => name.map(|name| SettingKind::Null(name, number)),
            Rule::period => quantities.next().map(SettingKind::Period),
            _ => None,
        };
    }
    kind
}

fn whole(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<OutputKind> {
    let mut kind = None;
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::kw_efforts => kind = Some(OutputKind::Efforts),
            Rule::kw_mass_matrix => kind = Some(OutputKind::MassMatrix),
            Rule::kw_accelerations => kind = Some(OutputKind::Accelerations),
            Rule::kw_loop_errors => kind = Some(OutputKind::LoopErrors),
            Rule::kw_loop_jacobian => kind = Some(OutputKind::LoopJacobian),
            Rule::kw_loop_forces => kind = Some(OutputKind::LoopForces),
            Rule::kw_closed_positions => kind = Some(OutputKind::ClosedPositions),
            Rule::kw_closed_velocities => kind = Some(OutputKind::ClosedVelocities),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    kind
}

fn driven(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<OutputKind> {
    let (mut side, mut rate) = (None, None);
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::kw_joint => side = Some(Side::Joint),
            Rule::kw_actuator => side = Some(Side::Actuator),
            Rule::kw_positions => rate = Some(Rate::Positions),
            Rule::kw_velocities => rate = Some(Rate::Velocities),
            Rule::kw_efforts => rate = Some(Rate::Efforts),
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    let (side, rate) = side.zip(rate)?;
    Some(OutputKind::Driven { side, rate })
}

rc_syntax::language!("`Kinematics NAME { … };`", words: [], HAS_DURATIONS = false, {
    file | kinematics | kw_kinematics => "`Kinematics`",
    import | kw_import => "`import`",
    solver => "`solver`",
    motion => "`pose`, `jacobian`, `velocity` or `acceleration`",
    whole => "`efforts`, `mass_matrix`, `accelerations` or an output of loops",
    holding => "`holding` or `passive`",
    alias => "`as NAME`",
    mount => "`fixed`, `planar`, `floating` or `spherical`",
    hinge => "`revolute X, Y, Z;` or `prismatic X, Y, Z;`",
    driven => "`joint` or `actuator`",
    kw_positions => "`positions`",
    kw_velocities => "`velocities`",
    kw_efforts => "`efforts`",
    place => "`at X, Y, Z`",
    rpy => "`rpy`",
    ring => "`loop`",
    pair => "`FRAME = FRAME;`",
    point => "`point`",
    path => "a name",
    form => "`as quaternion`",
    kw_quaternion => "`quaternion`",
    payload => "`payload`",
    kw_at => "`at`",
    gravity => "`gravity`",
    expressed => "`expressed in FRAME`",
    frame => "the name of a link",
    kw_in => "`in`",
    posture => "`posture`",
    grounding => "`math`, `scalars`, `lengths`, `matrices` or `frames`",
    coordinate => "`JOINT = NUMBER;`",
    equals => "`=`",
    inverse => "`inverse pose` or `inverse velocity`",
    kw_pose => "`pose`",
    kw_velocity => "`velocity`",
    within => "`within limits`",
    kw_limits => "`limits`",
    tolerance => "`tolerance`",
    iterations => "`iterations`",
    restarts => "`restarts`",
    seed => "`seed`",
    damped => "`damped`",
    null => "`null posture`",
    kw_posture => "`posture`",
    gain => "`gain`",
    period => "`period`",
    quantity => "a number",
    unit => "a unit",
});
