//! The page around the sections: HTML, its style and its script.

use super::svg::{base64, escape};
use super::{Item, Report, Section, Table};
use std::fmt::Write;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

pub(super) fn html(report: &Report) -> String {
    let mut out = String::from("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">");
    out.push_str("<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">");
    out.push_str("<meta name=\"color-scheme\" content=\"light dark\">");
    let title = escape(&report.title);
    let chips = report.chips.iter().fold(String::new(), |mut text, (k, v)| {
        write!(text, "<div><dt>{}</dt><dd>{}</dd></div>", escape(k), escape(v)).unwrap_or_default();
        text
    });
    let subtitle =
        if report.subtitle.is_empty() { String::new() } else { format!("<p>{}</p>", escape(&report.subtitle)) };
    write!(
        out,
        "<title>{title}</title><style>{STYLE}</style></head>\n<body><header><h1>{title}</h1>{subtitle}<dl>{chips}</dl></header><main>\n"
    )
    .unwrap_or_default();
    let mut id = 0;
    for part in &report.sections {
        section(&mut out, part, &mut id);
    }
    writeln!(out, "</main><div id=\"tip\" hidden></div><script>{SCRIPT}</script></body></html>").unwrap_or_default();
    out
}

fn section(out: &mut String, section: &Section, id: &mut usize) {
    let title = escape(&section.title);
    let (open, close) = if section.collapsed {
        (format!("<details><summary><h2>{title}</h2></summary>"), "</details>\n")
    } else {
        (format!("<section><h2>{title}</h2>"), "</section>\n")
    };
    out.push_str(&open);
    // Neighbouring plots share a grid; tables and texts take the whole width of it.
    out.push_str("<div class=\"rows\">");
    for item in &section.items {
        *id += 1;
        match item {
            Item::Text(text) => write!(out, "<p class=\"wide\">{}</p>", escape(text)).unwrap_or_default(),
            Item::Plot(plot) => out.push_str(&plot.html(*id)),
            Item::Table(content) => table(out, content),
            Item::SideView(view) => out.push_str(&view.html(*id)),
            Item::Picture { png, caption } => {
                let (data, caption) = (base64(png), escape(caption));
                write!(
                    out,
                    "<figure class=\"card wide\"><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\"><p class=\"note\">{caption}</p></figure>"
                )
                .unwrap_or_default();
            }
        }
    }
    out.push_str("</div>");
    out.push_str(close);
}

fn table(out: &mut String, table: &Table) {
    let width = table.rows.iter().map(Vec::len).chain([table.head.len()]).max().unwrap_or(0);
    let number = |text: &String| {
        let text = text.strip_suffix(" %").unwrap_or(text);
        text.is_empty() || text == "\u{2013}" || text.parse::<f64>().is_ok()
    };
    let numeric: Vec<bool> = (0..width)
        .map(|i| {
            let mut cells = table.rows.iter().filter_map(|r| r.get(i));
            cells.clone().any(|c| c.parse::<f64>().is_ok() || c.ends_with(" %")) && cells.all(number)
        })
        .collect();
    out.push_str("<div class=\"card wide table\"><table>");
    if !table.caption.is_empty() {
        write!(out, "<caption>{}</caption>", escape(&table.caption)).unwrap_or_default();
    }
    let mut row = |cells: &[String], tag: &str| {
        out.push_str("<tr>");
        for (i, cell) in cells.iter().enumerate() {
            // A hash or path without spaces may break anywhere, or it would push the table off the page.
            let long = cell.split(' ').any(|word| word.len() > 30);
            let class = match numeric.get(i) {
                Some(true) => " class=\"n\"",
                _ if long => " class=\"long\"",
                _ => "",
            };
            write!(out, "<{tag}{class}>{}</{tag}>", escape(cell)).unwrap_or_default();
        }
        out.push_str("</tr>");
    };
    if !table.head.is_empty() {
        row(&table.head, "th");
    }
    for cells in &table.rows {
        row(cells, "td");
    }
    out.push_str("</table></div>");
}
