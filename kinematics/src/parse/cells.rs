//! Parses how robots are held, and which of their frames stay together.

use super::{Rule, frame, quantity, trimmed};
use crate::ast::{Loop, LoopKind, Mount};
use pest::iterators::Pair;
use rc_robot::Held;
use rc_syntax::{Name, ParseContext};

pub(super) fn mount(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Option<Mount> {
    let span = trimmed(r, &pair);
    let (mut held, mut frames, mut place) = (None, Vec::new(), Vec::new());
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::kw_fixed => held = Some(Held::Fixed),
            Rule::kw_planar => held = Some(Held::Planar),
            Rule::kw_floating => held = Some(Held::Floating),
            Rule::kw_spherical => held = Some(Held::Spherical),
            Rule::frame => frames.extend(frame(r, part)),
            Rule::place => {
                for inside in part.into_inner() {
                    match inside.as_rule() {
                        Rule::quantity => place.extend(quantity(r, inside)),
                        Rule::rpy => {
                            let inside = inside.into_inner();
                            let given = inside.filter(|part| part.as_rule() == Rule::quantity);
                            place.extend(given.filter_map(|part| quantity(r, part)));
                        }
                        _ => {}
                    }
                }
            }
            Rule::semicolon => r.semicolon(&part),
            _ => {}
        }
    }
    let mut frames = frames.into_iter();
    Some(Mount {
        span,
        held: held?,
        link: frames.next()?,
        base: frames.next()?,
        place,
    })
}

pub(super) fn closed(r: &mut ParseContext<'_>, pair: Pair<'_, Rule>) -> Loop {
    let mut closed = Loop {
        name: Name::new("", r.span(&pair)),
        pairs: Vec::new(),
        joints: Vec::new(),
    };
    for part in pair.into_inner() {
        match part.as_rule() {
            Rule::name => closed.name = r.name(&part),
            Rule::pair => {
                let mut frames = Vec::new();
                for inside in part.into_inner() {
                    match inside.as_rule() {
                        Rule::frame => frames.extend(frame(r, inside)),
                        Rule::semicolon => r.semicolon(&inside),
                        _ => {}
                    }
                }
                let mut frames = frames.into_iter();
                closed.pairs.extend(frames.next().zip(frames.next()));
            }
            Rule::point | Rule::hinge => {
                let span = trimmed(r, &part);
                let (mut slides, mut numbers) = (None, Vec::new());
                for inside in part.into_inner() {
                    match inside.as_rule() {
                        Rule::kw_revolute => slides = Some(false),
                        Rule::kw_prismatic => slides = Some(true),
                        Rule::number => numbers.push(r.literal(&inside)),
                        Rule::semicolon => r.semicolon(&inside),
                        _ => {}
                    }
                }
                let kind = match slides {
                    None => LoopKind::Point,
                    Some(false) => LoopKind::Revolute(numbers),
                    Some(true) => LoopKind::Prismatic(numbers),
                };
                closed.joints.push((span, kind));
            }
            Rule::skipped => {
                let rule = match r.first_word(&part).text.to_lowercase().as_str() {
                    "point" => Rule::point,
                    "revolute" | "prismatic" => Rule::hinge,
                    _ => Rule::pair,
                };
                r.report_skipped(&part, rule);
            }
            _ => {}
        }
    }
    closed
}
