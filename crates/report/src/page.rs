//! An HTML page that needs no other file.

use crate::Scene;
use std::fmt::Write;

const STYLE: &str = include_str!("../assets/page.css");
const VIEWER_STYLE: &str = include_str!("../assets/viewer.css");
const VIEWER: &str = include_str!("../assets/viewer.js");
const SORTING: &str = include_str!("../assets/sorting.js");

/// A title and the content that follows it.
#[derive(Clone, Debug, Default)]
pub struct Page {
    /// Title of the window, and the heading.
    pub title: String,
    /// Text beneath the heading.
    pub subtitle: String,
    /// Content from top to bottom.
    pub blocks: Vec<Block>,
}

/// An element of a page. Text is escaped when it is inserted; only [`Block::Figures`] takes markup.
#[derive(Clone, Debug)]
pub enum Block {
    /// A heading that starts a section.
    Section(String),
    /// A smaller heading within a section.
    Subsection(String),
    /// A paragraph.
    Text(String),
    /// A list.
    List(Vec<String>),
    /// Preformatted text, as it was printed.
    Printed(String),
    /// A banner: its tone, a word in large letters, a sentence.
    Verdict(Tone, String, String),
    /// Names with their values.
    Facts(Vec<(String, String)>),
    /// A table.
    Table(Table),
    /// SVG figures side by side, each with its caption.
    Figures(Vec<(String, String)>),
    /// Interactive 3D views side by side, each with its caption. Their cameras move together.
    Views(Vec<(String, Scene)>),
}

/// The tone of a verdict.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tone {
    /// Good news.
    Good,
    /// To be taken with care.
    Doubtful,
    /// Bad news.
    Bad,
}

/// Rows under a header.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Header.
    pub columns: Vec<String>,
    /// Cells, as many as columns.
    pub rows: Vec<Vec<Cell>>,
    /// Whether clicking a header sorts by it.
    pub sortable: bool,
}

/// A cell of a table.
#[derive(Clone, Debug, Default)]
pub struct Cell {
    /// The text shown.
    pub text: String,
    /// Shown when the mouse hovers over it; empty for nothing.
    pub hint: String,
    /// Whether it is the best of its column.
    pub best: bool,
}

impl<T: Into<String>> From<T> for Cell {
    fn from(text: T) -> Cell {
        Cell { text: text.into(), ..Cell::default() }
    }
}

/// Returns text with the characters that are special in HTML written as entities: for content and for quoted
/// attributes.
#[must_use]
pub fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            _ => safe.push(c),
        }
    }
    safe
}

impl Page {
    /// Returns the complete file. It forbids the browser to request anything else.
    #[must_use]
    pub fn html(&self) -> String {
        let title = escaped(&self.title);
        let mut html = format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title}</title>\n<style>\n{STYLE}{VIEWER_STYLE}</style>\n</head>\n<body>\n<main>\n<header><h1>{title}</h1>"
        );
        if !self.subtitle.is_empty() {
            html += &format!("<p class=\"subtitle\">{}</p>", escaped(&self.subtitle));
        }
        html += "</header>\n";
        self.blocks.iter().for_each(|block| block.write(&mut html));
        html += "</main>\n";
        if self.blocks.iter().any(|block| matches!(block, Block::Table(table) if table.sortable)) {
            html += &format!("<script>\n{SORTING}</script>\n");
        }
        if self.blocks.iter().any(|block| matches!(block, Block::Views(_))) {
            html += &format!("<script>\n{VIEWER}</script>\n");
        }
        html += "</body>\n</html>\n";
        html
    }
}

impl Block {
    fn write(&self, html: &mut String) {
        let mut put = |text: String| html.push_str(&text);
        match self {
            Block::Section(name) => put(format!("<h2>{}</h2>\n", escaped(name))),
            Block::Subsection(name) => put(format!("<h3>{}</h3>\n", escaped(name))),
            Block::Text(text) => put(format!("<p>{}</p>\n", escaped(text))),
            Block::List(items) => {
                let items: String = items.iter().map(|item| format!("<li>{}</li>", escaped(item))).collect();
                put(format!("<ul>{items}</ul>\n"));
            }
            Block::Printed(text) => put(format!("<pre tabindex=\"0\">{}</pre>\n", escaped(text))),
            Block::Verdict(tone, word, sentence) => put(format!(
                "<div class=\"verdict {}\"><strong>{}</strong><span>{}</span></div>\n",
                tone.class(),
                escaped(word),
                escaped(sentence)
            )),
            Block::Facts(facts) => {
                let facts: String = facts
                    .iter()
                    .map(|(name, value)| format!("<div><dt>{}</dt><dd>{}</dd></div>", escaped(name), escaped(value)))
                    .collect();
                put(format!("<dl>{facts}</dl>\n"));
            }
            Block::Table(table) => put(table.html()),
            Block::Figures(figures) => {
                let figures: String = figures
                    .iter()
                    .map(|(caption, svg)| {
                        format!("<figure>{svg}<figcaption>{}</figcaption></figure>\n", escaped(caption))
                    })
                    .collect();
                put(format!("<div class=\"figures\">\n{figures}</div>\n"));
            }
            Block::Views(views) => {
                let views: String = views.iter().map(|(caption, scene)| view(caption, scene)).collect();
                put(format!("<div class=\"views\">\n{views}</div>\n"));
            }
        }
    }
}

impl Tone {
    fn class(self) -> &'static str {
        match self {
            Tone::Good => "good",
            Tone::Doubtful => "doubtful",
            Tone::Bad => "bad",
        }
    }
}

fn view(caption: &str, scene: &Scene) -> String {
    // Within a script only this character can end it.
    let json = scene.json().to_string().replace('<', "\\u003c");
    let caption = escaped(caption);
    format!(
        "<figure class=\"view\" data-view tabindex=\"0\" aria-label=\"{caption}\">\n\
         <script type=\"application/json\">{json}</script>\n\
         <div class=\"fallback\"><p>The interactive view needs a browser with JavaScript and WebGL 2.</p>{}</div>\n\
         <figcaption>{caption}</figcaption>\n</figure>\n",
        scene.fallback
    )
}

impl Table {
    fn html(&self) -> String {
        let mut html = String::new();
        let mut put = |text: std::fmt::Arguments<'_>| html.write_fmt(text).expect("a string can be written to");
        let class = if self.sortable { " class=\"sortable\"" } else { "" };
        put(format_args!("<div class=\"table\" tabindex=\"0\"><table{class}>\n<thead><tr>"));
        for column in &self.columns {
            put(format_args!("<th scope=\"col\">{}</th>", escaped(column)));
        }
        put(format_args!("</tr></thead>\n<tbody>\n"));
        for row in &self.rows {
            put(format_args!("<tr>"));
            for cell in row {
                let best = if cell.best { " class=\"best\"" } else { "" };
                let hint =
                    if cell.hint.is_empty() { String::new() } else { format!(" title=\"{}\"", escaped(&cell.hint)) };
                put(format_args!("<td{best}{hint}>{}</td>", escaped(&cell.text)));
            }
            put(format_args!("</tr>\n"));
        }
        put(format_args!("</tbody></table></div>\n"));
        html
    }
}
