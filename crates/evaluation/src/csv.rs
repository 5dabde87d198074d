//! Lines of a CSV file.

/// One line without its end. Fields with a comma, a quote or a line break are quoted.
#[must_use]
pub fn csv_line<S: AsRef<str>>(fields: impl IntoIterator<Item = S>) -> String {
    fields.into_iter().map(|field| quoted(field.as_ref())).collect::<Vec<_>>().join(",")
}

fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_fields_that_need_it_are_quoted() {
        assert_eq!(csv_line(["a b", "1,5", "say \"x\"", ""]), r#"a b,"1,5","say ""x""","#);
    }
}
