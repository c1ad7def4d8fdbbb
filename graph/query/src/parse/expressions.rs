//! Expressions: `OR` binds last, then `XOR`, `AND`, `NOT`, comparisons, sums, products.

use super::{DEEPEST, MOST_OPERATORS, Parser, Result, slot};
use crate::Cell;
use crate::ast::{Aggregate, Expr, Function, InUnit, Name, Operator};
use crate::lexer::Token;
use rc_diagnostics::{Diagnostic, Span, foreign};

impl Parser<'_> {
    pub(super) fn expr(&mut self) -> Result<Expr> {
        self.depth += 1;
        if self.depth > DEEPEST {
            let message = format!("expressions are nested more than {DEEPEST} levels deep");
            return self.error("nested-too-deep", message);
        }
        let result = self.or();
        self.depth -= 1;
        result
    }

    /// Counts a level that the tree of an expression may get.
    fn operator(&mut self) -> Result<()> {
        self.operators += 1;
        if self.operators > MOST_OPERATORS {
            let message = format!("a query has more than {MOST_OPERATORS} operators");
            return self.error("nested-too-deep", message);
        }
        Ok(())
    }

    fn binary(
        &mut self,
        next: fn(&mut Self) -> Result<Expr>,
        operator: fn(&mut Self) -> Option<Operator>,
    ) -> Result<Expr> {
        let mut left = next(self)?;
        let mut count = 0;
        while let Some(operator) = operator(self) {
            self.operator()?;
            count += 1;
            // A long chain is a deep tree.
            if count > DEEPEST {
                let message = format!("an expression has more than {DEEPEST} operators in a row");
                return self.error("nested-too-deep", message);
            }
            let right = next(self)?;
            left = Expr::Binary(operator, Box::new(left), Box::new(right));
        }
        Ok(left)
    }

    fn or(&mut self) -> Result<Expr> {
        self.binary(Self::xor, |p| p.word("OR").then_some(Operator::Or))
    }

    fn xor(&mut self) -> Result<Expr> {
        self.binary(Self::and, |p| p.word("XOR").then_some(Operator::Xor))
    }

    fn and(&mut self) -> Result<Expr> {
        self.binary(Self::not, |p| p.word("AND").then_some(Operator::And))
    }

    fn not(&mut self) -> Result<Expr> {
        let mut count = 0;
        while self.word("NOT") {
            count += 1;
        }
        let mut value = self.comparison()?;
        // Two of them are none, but make a truth value.
        if count > 0 {
            self.operator()?;
        }
        for _ in 0..(if count == 0 { 0 } else { 2 - count % 2 }) {
            value = Expr::Not(Box::new(value));
        }
        Ok(value)
    }

    fn comparison(&mut self) -> Result<Expr> {
        let left = self.sum()?;
        let sign = |p: &mut Self| {
            let signs = [
                ("=", Operator::Equal),
                ("<>", Operator::NotEqual),
                ("<=", Operator::LessOrEqual),
                (">=", Operator::GreaterOrEqual),
                ("<", Operator::Less),
                (">", Operator::Greater),
            ];
            let found = signs.into_iter().find(|(sign, _)| p.sign(sign));
            found.map(|(_, operator)| operator)
        };
        if let Some(operator) = sign(self) {
            let right = self.sum()?;
            if matches!(
                self.peek(),
                Token::Sign("=" | "<>" | "<=" | ">=" | "<" | ">")
            ) {
                return self.expected("`AND` between two comparisons");
            }
            return Ok(Expr::Binary(operator, Box::new(left), Box::new(right)));
        }
        let operator = if self.word("IN") {
            Operator::In
        } else if self.word("CONTAINS") {
            Operator::Contains
        } else if self.is_word("STARTS") || self.is_word("ENDS") {
            let operator = if self.word("STARTS") {
                Operator::StartsWith
            } else {
                self.word("ENDS");
                Operator::EndsWith
            };
            if !self.word("WITH") {
                return self.expected("`WITH`");
            }
            operator
        } else if self.word("IS") {
            let not = self.word("NOT");
            if !self.word("NULL") {
                return self.expected("`NULL`");
            }
            return Ok(Expr::IsNull(Box::new(left), !not));
        } else {
            return Ok(left);
        };
        let right = self.sum()?;
        Ok(Expr::Binary(operator, Box::new(left), Box::new(right)))
    }

    fn sum(&mut self) -> Result<Expr> {
        self.binary(Self::product, |p| {
            if p.sign("+") {
                Some(Operator::Add)
            } else {
                p.sign("-").then_some(Operator::Subtract)
            }
        })
    }

    fn product(&mut self) -> Result<Expr> {
        self.binary(Self::unary, |p| {
            let signs = [
                ("*", Operator::Multiply),
                ("/", Operator::Divide),
                ("%", Operator::Modulo),
            ];
            let found = signs.into_iter().find(|(sign, _)| p.sign(sign));
            found.map(|(_, operator)| operator)
        })
    }

    fn unary(&mut self) -> Result<Expr> {
        let mut count = 0;
        while self.sign("-") {
            count += 1;
        }
        let mut value = self.postfix()?;
        if count % 2 == 1 {
            self.operator()?;
            value = Expr::Negate(Box::new(value));
        }
        Ok(value)
    }

    fn postfix(&mut self) -> Result<Expr> {
        let mut value = self.atom()?;
        let mut count = 0;
        loop {
            count += 1;
            if count > DEEPEST {
                return self.error("nested-too-deep", "too many steps in a row".to_owned());
            }
            let unit = self.unit();
            if unit.is_some() || matches!(self.peek(), Token::Sign("." | "[")) {
                self.operator()?;
            }
            if let Some(unit) = unit {
                value = Expr::InUnit(Box::new(InUnit {
                    of: value,
                    unit,
                    factor: None,
                }));
                continue;
            }
            if self.sign(".") {
                value = Expr::Property(Box::new(value), self.schema_name("an attribute")?);
            } else if self.sign("[") {
                let index = self.expr()?;
                self.need("]")?;
                value = Expr::Index(Box::new(value), Box::new(index));
            } else {
                return Ok(value);
            }
        }
    }

    /// `unit "kg"`, as in GDSL.
    fn unit(&mut self) -> Option<Name> {
        let next = self.tokens.get(self.at + 1);
        let (true, Some((Token::Text(text), start, end))) = (self.is_word("unit"), next) else {
            return None;
        };
        let span = Span::new(self.source, *start, *end);
        let text = text.clone();
        self.at += 2;
        Some(Name { text, span })
    }

    fn atom(&mut self) -> Result<Expr> {
        match self.peek().clone() {
            Token::Int(number) => {
                self.at += 1;
                Ok(Expr::Literal(Cell::Int(number)))
            }
            Token::Float(number) => {
                self.at += 1;
                Ok(Expr::Literal(Cell::Float(number)))
            }
            Token::Text(text) => {
                self.at += 1;
                Ok(Expr::Literal(Cell::Text(text.into())))
            }
            Token::Sign("(") => {
                self.at += 1;
                let value = self.expr()?;
                self.need(")")?;
                Ok(value)
            }
            Token::Sign("[") => {
                self.at += 1;
                let mut all = Vec::new();
                if !self.sign("]") {
                    all.push(self.expr()?);
                    while self.sign(",") {
                        all.push(self.expr()?);
                    }
                    self.need("]")?;
                }
                Ok(Expr::List(all))
            }
            Token::Sign("$") => {
                self.at += 1;
                let name = self.name("a parameter")?;
                let slot = slot(&mut self.parameters, &name.text);
                Ok(Expr::Parameter(name, slot))
            }
            Token::Word(word) => self.named(&word),
            _ => self.expected("a value"),
        }
    }

    fn named(&mut self, word: &str) -> Result<Expr> {
        let span = self.span();
        let literal = match word.to_ascii_lowercase().as_str() {
            "true" => Some(Cell::Bool(true)),
            "false" => Some(Cell::Bool(false)),
            "null" => Some(Cell::Null),
            _ => None,
        };
        self.at += 1;
        if let Some(literal) = literal {
            return Ok(Expr::Literal(literal));
        }
        if self.sign("(") {
            return self.call(word, span);
        }
        let known = self
            .scope
            .iter()
            .find(|at| self.variables[**at].text == word);
        if let Some(slot) = known {
            return Ok(Expr::Variable(*slot));
        }
        let names = self
            .scope
            .iter()
            .map(|at| self.variables[*at].text.as_str());
        let names: Vec<&str> = names.filter(|name| !name.is_empty()).collect();
        let message = format!("unknown variable `{}`", foreign::clean(word));
        let diagnostic = Diagnostic::error("unknown-variable", span, message);
        Err(diagnostic.suggest(word, names))
    }

    fn call(&mut self, word: &str, span: Span) -> Result<Expr> {
        let aggregates = [
            ("count", Aggregate::Count),
            ("sum", Aggregate::Sum),
            ("avg", Aggregate::Average),
            ("min", Aggregate::Least),
            ("max", Aggregate::Greatest),
            ("collect", Aggregate::Collect),
        ];
        let functions = [
            ("id", Function::Id, 1),
            ("type", Function::Type, 1),
            ("mid", Function::Type, 1),
            ("mmid", Function::Domain, 1),
            ("size", Function::Size, 1),
            ("abs", Function::Absolute, 1),
            ("coalesce", Function::Coalesce, 0),
            ("toString", Function::ToText, 1),
            ("startNode", Function::StartNode, 1),
            ("endNode", Function::EndNode, 1),
            ("pose", Function::Pose, 2),
            ("chain", Function::Chain, 2),
        ];
        let is = |name: &str| name.eq_ignore_ascii_case(word);
        if let Some((_, aggregate)) = aggregates.iter().find(|(name, _)| is(name)) {
            if *aggregate == Aggregate::Count && self.sign("*") {
                self.need(")")?;
                return Ok(Expr::Aggregate(*aggregate, false, None));
            }
            let distinct = self.word("DISTINCT");
            let value = self.expr()?;
            if value.has_aggregate() {
                let message = "a sum of a sum is not possible";
                return Err(Diagnostic::error("query-aggregate", span, message));
            }
            self.need(")")?;
            return Ok(Expr::Aggregate(*aggregate, distinct, Some(Box::new(value))));
        }
        let Some((_, function, count)) = functions.iter().find(|(name, ..)| is(name)) else {
            let message = format!("unknown function `{}`", foreign::clean(word));
            let names = functions.iter().map(|(name, ..)| *name);
            let names = names.chain(aggregates.iter().map(|(name, _)| *name));
            let diagnostic = Diagnostic::error("unknown-function", span, message);
            return Err(diagnostic.suggest(word, names));
        };
        let mut arguments = vec![self.expr()?];
        while self.sign(",") {
            arguments.push(self.expr()?);
        }
        self.need(")")?;
        if *count != 0 && arguments.len() != *count {
            let plural = if *count == 1 { "" } else { "s" };
            let found = arguments.len();
            let message = format!("`{word}` takes {count} argument{plural}, found {found}");
            return Err(Diagnostic::error("query-syntax", span, message));
        }
        Ok(Expr::Call(*function, arguments))
    }
}
