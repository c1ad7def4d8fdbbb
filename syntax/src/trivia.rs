//! Comments and the documentation in them.

use crate::scan::{SegmentKind, lines, segments};

/// The comments of a text. The syntax tree does not contain them.
#[derive(Clone, Debug)]
pub struct Trivia<'a> {
    text: &'a str,
    comments: Vec<(usize, usize)>,
}

impl<'a> Trivia<'a> {
    /// Finds the comments of `text`. `//` inside a string is not a comment.
    pub fn new(text: &'a str) -> Self {
        let comments = segments(text).filter(|(kind, ..)| *kind == SegmentKind::Comment);
        Self {
            text,
            comments: comments.map(|(_, start, stop)| (start, stop)).collect(),
        }
    }

    /// The byte ranges of the comments, in order.
    pub fn comments(&self) -> &[(usize, usize)] {
        &self.comments
    }

    /// Whether the text contains only comments and white space.
    pub fn is_blank(&self) -> bool {
        self.end_of_token_before(self.text.len()) == 0
    }

    /// The comment that ends at `stop`.
    fn ending_at(&self, stop: usize) -> Option<(usize, usize)> {
        let at = self.comments.binary_search_by_key(&stop, |(_, end)| *end);
        at.ok().map(|at| self.comments[at])
    }

    /// The offset of a `/*` without a `*/`.
    pub fn unclosed(&self) -> Option<usize> {
        let (start, stop) = *self.comments.last()?;
        let comment = &self.text[start..stop];
        let closed = comment.len() >= 4 && comment.ends_with("*/");
        (comment.starts_with("/*") && !closed).then_some(start)
    }

    /// The end of the last token before `at`. White space and comments are not tokens.
    pub fn end_of_token_before(&self, at: usize) -> usize {
        let mut end = at;
        loop {
            let trimmed = self.text[..end].trim_end().len();
            match self.ending_at(trimmed) {
                Some((start, _)) => end = start,
                None => return trimmed,
            }
        }
    }

    /// The documentation of the declaration that starts at `at`: the `/// …` lines or the `/** …
    /// */` directly before it, without the comment marks.
    pub fn documentation(&self, at: usize) -> Vec<String> {
        let mut blocks: Vec<&str> = Vec::new();
        let mut end = self.text[..at].trim_end().len();
        while let Some((start, stop)) = self.ending_at(end) {
            let comment = &self.text[start..stop];
            let is_line = comment.starts_with("///") && !comment.starts_with("////");
            let is_block = comment.starts_with("/**") && comment.len() > 4;
            // A comment after code on the same line does not document the next line.
            let line = self.text[..start].rsplit(['\n', '\r']).next();
            let line = line.unwrap_or_default();
            if !(is_line || is_block) || !line.trim().is_empty() {
                break;
            }
            blocks.push(comment);
            end = self.text[..start].trim_end().len();
            if is_block {
                break;
            }
        }
        blocks
            .iter()
            .rev()
            .flat_map(|block| lines_of(block))
            .collect()
    }

    /// The text without comments and with single spaces. Texts that differ only in layout are
    /// equal.
    pub fn significant(&self) -> String {
        let mut out = String::with_capacity(self.text.len());
        let mut at = 0;
        for (start, stop) in self
            .comments
            .iter()
            .copied()
            .chain([(self.text.len(), self.text.len())])
        {
            for word in self.text[at..start].split_whitespace() {
                out.push_str(word);
                out.push(' ');
            }
            at = stop;
        }
        out
    }
}

fn lines_of(comment: &str) -> Vec<String> {
    if let Some(line) = comment.strip_prefix("///") {
        return vec![
            line.trim_end()
                .strip_prefix(' ')
                .unwrap_or(line.trim_end())
                .to_owned(),
        ];
    }
    let inner = comment.trim_start_matches("/**").trim_end_matches("*/");
    let mut lines: Vec<String> = lines(inner)
        .map(|line| line.trim().trim_start_matches('*').trim().to_owned())
        .skip_while(String::is_empty)
        .collect();
    while lines.last().is_some_and(String::is_empty) {
        lines.pop();
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::Trivia;

    #[test]
    fn comments_are_found_outside_strings_only() {
        let text = "import \"../..//x.idsl\"; // one\n/* two */ module";
        let trivia = Trivia::new(text);
        assert_eq!(trivia.significant(), "import \"../..//x.idsl\"; module ");
        assert_eq!(
            trivia.end_of_token_before(text.find("module").unwrap_or(0)),
            23
        );
    }

    #[test]
    fn documentation_is_directly_before_its_declaration() {
        let text = "int a; /// not of b\n/// about b\n///  indented\nint b;\n\n/**\n * about c\n */\nint c;";
        let trivia = Trivia::new(text);
        let doc = |what: &str| trivia.documentation(text.find(what).unwrap_or(0));
        assert_eq!(doc("int b"), ["about b", " indented"]);
        assert_eq!(doc("int c"), ["about c"]);
        assert!(doc("int a").is_empty());
    }
}
