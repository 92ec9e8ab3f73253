//! Statements of OBJ and MTL files, which share their grammar: one a line, a backslash at its end
//! goes on in the next, `#` begins a comment.

use std::borrow::Cow;

/// A statement: the line that it begins in, from 1, its keyword and what follows, without spaces
/// around it. A comment at its end is still there, as names may hold `#`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Statement<'a> {
    pub(super) line: usize,
    pub(super) key: &'a str,
    pub(super) rest: &'a str,
}

impl<'a> Statement<'a> {
    /// What follows the keyword without a comment: for statements whose words are no names.
    pub(super) fn plain(&self) -> &'a str {
        self.rest.split_once('#').map_or(self.rest, |(before, _)| before)
    }

    /// The name that follows, and what it may be instead, where something in it may be a comment.
    pub(super) fn names(&self) -> (&'a str, Option<&'a str>) {
        (self.rest, comment(self.rest).map(|at| self.rest[..at].trim_end()).filter(|name| !name.is_empty()))
    }
}

/// Where a comment begins in a line: at a `#` that stands first or behind a space.
fn comment(line: &str) -> Option<usize> {
    let bytes = line.as_bytes();
    line.match_indices('#').map(|(at, _)| at).find(|&at| at == 0 || bytes[at - 1].is_ascii_whitespace())
}

/// Gives each statement of a text to `each`.
///
/// # Errors
/// The first that `each` gives back.
pub(super) fn statements<E>(text: &str, mut each: impl FnMut(Statement<'_>) -> Result<(), E>) -> Result<(), E> {
    let text = with_newlines(text);
    let mut lines = text.split('\n').enumerate();
    let mut joined = String::new();
    while let Some((i, line)) = lines.next() {
        let mut line = line.trim_ascii();
        if goes_on(line) {
            joined.clear();
            joined.push_str(&line[..line.len() - 1]);
            for (_, next) in lines.by_ref() {
                let next = next.trim_ascii();
                joined.push(' ');
                if !goes_on(next) {
                    joined.push_str(next);
                    break;
                }
                joined.push_str(&next[..next.len() - 1]);
            }
            line = joined.trim_ascii();
        }
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let end = line.bytes().position(|b| b.is_ascii_whitespace()).unwrap_or(line.len());
        let (key, rest) = line.split_at(end);
        each(Statement { line: i + 1, key, rest: rest.trim_ascii_start() })?;
    }
    Ok(())
}

/// Whether a line goes on in the next; a path at the end of a comment does not.
fn goes_on(line: &str) -> bool {
    line.ends_with('\\') && comment(line).is_none()
}

/// Lines that end in a carriage return alone, as old Macs wrote them, end in a newline.
fn with_newlines(text: &str) -> Cow<'_, str> {
    let lone = |(at, _): (usize, &str)| text.as_bytes().get(at + 1) != Some(&b'\n');
    if text.match_indices('\r').any(lone) {
        Cow::Owned(text.replace("\r\n", "\n").replace('\r', "\n"))
    } else {
        Cow::Borrowed(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(text: &str) -> Vec<(usize, String, String)> {
        let mut out = Vec::new();
        let each = |s: Statement<'_>| {
            out.push((s.line, s.key.to_owned(), s.rest.to_owned()));
            Ok::<(), ()>(())
        };
        statements(text, each).unwrap();
        out
    }

    #[test]
    fn lines_end_go_on_and_are_commented_in_every_way() {
        let plain = all("v 1 2 3\nf 1 2 3\n");
        for same in ["v 1 2 3\r\nf 1 2 3", "v 1 2 3\rf 1 2 3\r", "\tv\t1 2 3  \n  f 1 2 3", "v 1 2 3\nf 1 2 3\\"] {
            let told: Vec<_> =
                all(same).into_iter().map(|(line, key, rest)| (line, key, rest.trim().to_owned())).collect();
            assert_eq!(told, plain, "{same:?}");
        }
        for joined in ["v 1 \\\n2 3\nf 1 2 3", "v 1 \\\r\n\t2 3\r\nf 1 2 3", "v 1\\  \n2 3\nf 1 2 3"] {
            let told: Vec<_> = all(joined)
                .into_iter()
                .map(|s| s.2.split_whitespace().map(str::to_owned).collect::<Vec<_>>())
                .collect();
            assert_eq!(told, [["1", "2", "3"], ["1", "2", "3"]], "{joined:?}");
        }
        assert_eq!(all("v 1 \\\n2 3\nf 1 2 3")[1].0, 3, "lines are counted as they stand in the file");
        // A comment's backslash joins nothing.
        assert_eq!(all("# c:\\a\\\nv 1 2 3\nv 4 5 6 # b \\\nf 1 2 3").len(), 3);
        assert_eq!(all("#\n\n \\\n\\\n"), []);
        let named = |rest| Statement { line: 1, key: "usemtl", rest }.names();
        assert_eq!(named("a b # red"), ("a b # red", Some("a b")));
        assert_eq!(named("a#1"), ("a#1", None));
        assert_eq!(named("#1"), ("#1", None));
    }
}
