//! Pages that a program writes, in lines that are read as they are.

/// Width of a line of prose in docs/, in characters.
const WIDTH: usize = 112;

/// The Markdown text with its paragraphs and list items broken into lines of at most 112
/// characters. Tables, headings, pictures and what is set as code stay as they are, so does a word
/// that is longer.
pub fn wrapped(page: &str) -> String {
    let mut out = String::with_capacity(page.len() + page.len() / 50);
    let mut fenced = false;
    for line in page.split_inclusive('\n') {
        let fence = line.starts_with("```");
        fenced ^= fence;
        let kept = fenced || fence || ["|", "#", "!", "    "].iter().any(|start| line.starts_with(start));
        if kept || line.trim_end().chars().count() <= WIDTH {
            out.push_str(line);
            continue;
        }
        // What follows a list item's first line stands below its text.
        let indent = if line.starts_with("- ") { "  " } else { "" };
        let mut length = 0;
        for word in line.trim_end().split(' ') {
            let count = word.chars().count();
            if length > 0 && length + 1 + count > WIDTH {
                out.push('\n');
                out.push_str(indent);
                length = indent.len();
            } else if length > 0 {
                out.push(' ');
                length += 1;
            }
            out.push_str(word);
            length += count;
        }
        if line.ends_with('\n') {
            out.push('\n');
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prose_is_wrapped_and_tables_and_code_are_not() {
        let long = "word ".repeat(60);
        let page = format!("# {long}\n\n{long}\n| {long} |\n    {long}\n```\n{long}\n```\n- {long}\nend");
        let wrapped = wrapped(&page);
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(words(&wrapped), words(&page));
        let lines: Vec<&str> = wrapped.lines().collect();
        let over = lines.iter().filter(|l| l.chars().count() > WIDTH).count();
        // Heading, table, two of code.
        assert_eq!(over, 4, "{wrapped}");
        assert!(lines.iter().filter(|l| l.starts_with("  word")).count() >= 2 && wrapped.ends_with("end"));
        // What is short is left alone.
        assert_eq!(super::wrapped("a\n\nb c\n"), "a\n\nb c\n");
    }
}
