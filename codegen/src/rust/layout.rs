//! The layout of generated Rust: `prettyplease`'s, with an empty line between items and between
//! functions.

use proc_macro2::Span;
use syn::token::Bracket;
use syn::{
    AttrStyle, Attribute, Expr, ExprLit, Ident, ImplItem, Item, Lit, LitStr, Meta, MetaNameValue,
    Token, TraitItem,
};

/// A documentation comment that stands for an empty line.
const EMPTY_LINE: &str = "///@";

/// Lays out a file. Ordinary comments may stand before the first line of code only.
pub(super) fn file(text: &str) -> Result<String, syn::Error> {
    let code = text
        .lines()
        .take_while(|line| line.starts_with("// ") || line.is_empty())
        .map(|line| line.len() + 1)
        .sum::<usize>();
    let (header, code) = text.split_at(code.min(text.len()));
    let mut file = syn::parse_file(code)?;
    let begins = file.attrs.is_empty();
    space(&mut file.items, begins);
    let laid_out = prettyplease::unparse(&file);
    let mut out = String::with_capacity(text.len());
    out.push_str(header.trim_start());
    for line in laid_out.lines() {
        if line.trim_start() != EMPTY_LINE {
            out.push_str(line);
        }
        out.push('\n');
    }
    Ok(out)
}

/// Puts an empty line before every item but the first, and none between two imports or two modules.
fn space(items: &mut [Item], begins: bool) {
    let mut before: Option<u8> = (!begins).then_some(0);
    for item in items {
        let group = match &item {
            Item::Use(item) if matches!(item.vis, syn::Visibility::Inherited) => 1,
            Item::Use(_) => 2,
            Item::Mod(item) if item.content.is_none() => 3,
            _ => 0,
        };
        if before.is_some_and(|before| before == 0 || before != group)
            && let Some(attributes) = attributes(item)
        {
            attributes.insert(0, empty_line());
        }
        before = Some(group);
        match item {
            Item::Mod(module) => {
                if let Some((_, items)) = &mut module.content {
                    space(items, true);
                }
            }
            Item::Impl(block) => {
                let functions = block.items.iter_mut().skip(1);
                functions.for_each(|item| match item {
                    ImplItem::Fn(function) => function.attrs.insert(0, empty_line()),
                    ImplItem::Const(constant) => constant.attrs.insert(0, empty_line()),
                    _ => {}
                });
            }
            Item::Trait(block) => {
                let functions = block.items.iter_mut().skip(1);
                functions.for_each(|item| {
                    if let TraitItem::Fn(function) = item {
                        function.attrs.insert(0, empty_line());
                    }
                });
            }
            _ => {}
        }
    }
}

/// `#[doc = "@"]`, made without the parser.
fn empty_line() -> Attribute {
    let span = Span::call_site();
    let value = ExprLit {
        attrs: Vec::new(),
        lit: Lit::Str(LitStr::new("@", span)),
    };
    Attribute {
        pound_token: Token![#](span),
        style: AttrStyle::Outer,
        bracket_token: Bracket(span),
        meta: Meta::NameValue(MetaNameValue {
            path: Ident::new("doc", span).into(),
            eq_token: Token![=](span),
            value: Expr::Lit(value),
        }),
    }
}

fn attributes(item: &mut Item) -> Option<&mut Vec<Attribute>> {
    Some(match item {
        Item::Const(item) => &mut item.attrs,
        Item::Enum(item) => &mut item.attrs,
        Item::Fn(item) => &mut item.attrs,
        Item::Impl(item) => &mut item.attrs,
        Item::Mod(item) => &mut item.attrs,
        Item::Static(item) => &mut item.attrs,
        Item::Struct(item) => &mut item.attrs,
        Item::Trait(item) => &mut item.attrs,
        Item::Type(item) => &mut item.attrs,
        Item::Use(item) => &mut item.attrs,
        _ => return None,
    })
}
