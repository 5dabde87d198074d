//! Lines of CSV text.

/// The fields of a line, without the spaces around them; one in double quotes may hold commas, and quotes written twice.
#[must_use]
pub fn csv_fields(line: &str) -> Vec<String> {
    let mut all = vec![String::new()];
    let mut quoted = false;
    let mut characters = line.trim_end_matches('\r').chars().peekable();
    while let Some(c) = characters.next() {
        let last = all.last_mut().expect("there is always a field");
        match c {
            '"' if quoted && characters.peek() == Some(&'"') => {
                characters.next();
                last.push('"');
            }
            '"' => quoted = !quoted,
            ',' if !quoted => all.push(String::new()),
            _ => last.push(c),
        }
    }
    all.iter_mut().for_each(|field| *field = field.trim().to_owned());
    all
}

/// One line without its end. A line break within a field becomes a space, so that a row is a line.
#[must_use]
pub fn csv_line<S: AsRef<str>>(fields: impl IntoIterator<Item = S>) -> String {
    fields.into_iter().map(|field| quoted(field.as_ref())).collect::<Vec<_>>().join(",")
}

/// In quotes where it would otherwise be taken for more than one field, or for a comment.
fn quoted(field: &str) -> String {
    if field.starts_with('#') || field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\"").replace("\r\n", " ").replace(['\n', '\r'], " "))
    } else {
        field.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_may_be_quoted() {
        assert_eq!(csv_fields(r#"a, b ,"c,""d""",,"#), ["a", "b", r#"c,"d""#, "", ""]);
        assert_eq!(csv_fields("a, \"b,1\" \r"), ["a", "b,1"]);
    }

    #[test]
    fn only_fields_that_need_it_are_quoted() {
        let line = csv_line(["a b", "1,5", "say \"x\"", "", "#1", "two\r\nlines"]);
        assert_eq!(line, r##"a b,"1,5","say ""x""",,"#1","two lines""##);
        assert_eq!(csv_fields(&line), ["a b", "1,5", "say \"x\"", "", "#1", "two lines"]);
    }
}
