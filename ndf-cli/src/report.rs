//! Reports as one HTML page that needs nothing else: pictures and style are inside.
//!
//! ```
//! use ndf_cli::report::Report;
//! let page = Report::new("A run <1>")
//!     .paragraph("Two figures.")
//!     .table("Fit", &["figure", "value"], &[vec!["rms".into(), "0.001".into()]])
//!     .to_html();
//! assert!(page.contains("A run &lt;1&gt;"));
//! ```

use base64::Engine;
use ndf_core::Progress;
use ndf_mesh::TriangleMesh;
use ndf_mesh::io::VertexScalars;

use crate::chart::Spread;
use crate::output::{Failure, grouped, readable};
use crate::render::{Camera, ColourMap, Legend, Scene, Style, View, png_bytes, render};

/// A page under construction: sections in the order they are added. Texts are escaped; none can add markup.
#[derive(Clone, Debug)]
pub struct Report {
    title: String,
    body: String,
    has_viewer: bool,
}

/// A picture of a report.
#[derive(Clone, Debug)]
pub struct Figure {
    /// PNG file.
    pub png: Vec<u8>,
    /// What it shows; also read out where it cannot be seen.
    pub caption: String,
    /// Scale of its colours.
    pub legend: Option<Legend>,
}

/// Two pictures to be compared.
#[derive(Clone, Debug)]
pub struct Pair {
    /// PNG files, or the reasons why there are none.
    pub pictures: [Result<Vec<u8>, String>; 2],
    /// What they show.
    pub caption: String,
}

/// How the mesh of a figure is taken.
#[derive(Clone, Copy, Debug)]
pub struct Shot {
    /// The side it is seen from.
    pub view: View,
    /// How it is drawn.
    pub style: Style,
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
}

impl Default for Shot {
    fn default() -> Self {
        Self { view: View::default(), style: Style::default(), width: 720, height: 540 }
    }
}

impl Figure {
    /// A picture of a mesh, coloured by a scalar and its map if they are given.
    ///
    /// # Errors
    /// If the picture is larger than PNG allows.
    ///
    /// # Panics
    /// If the scalar has not one value a vertex.
    pub fn of_mesh(
        mesh: &TriangleMesh,
        scalar: Option<(&VertexScalars, ColourMap)>,
        caption: &str,
        shot: &Shot,
        progress: &dyn Progress,
    ) -> Result<Self, Failure> {
        let camera = Camera::framing(mesh.positions(), shot.view, shot.width, shot.height);
        let mut scene = Scene::new(mesh);
        let mut legend = None;
        if let Some((scalar, map)) = scalar {
            legend = Some(map.legend(17));
            scene = scene.painted(&scalar.values, map);
        }
        let png = png_bytes(&render(&scene, &camera, &shot.style, progress), false)?;
        Ok(Self { png, caption: caption.to_owned(), legend })
    }
}

impl Report {
    /// A page with a title.
    pub fn new(title: &str) -> Self {
        Self { title: escaped(title), body: String::new(), has_viewer: false }
    }

    /// Adds a heading.
    #[must_use]
    pub fn heading(mut self, text: &str) -> Self {
        self.body += &format!("<h2>{}</h2>\n", escaped(text));
        self
    }

    /// Adds a paragraph.
    #[must_use]
    pub fn paragraph(mut self, text: &str) -> Self {
        self.body += &format!("<p>{}</p>\n", escaped(text));
        self
    }

    /// Adds a command or other text to be copied as it stands.
    #[must_use]
    pub fn code(mut self, text: &str) -> Self {
        self.body += &format!("<pre><code>{}</code></pre>\n", escaped(text));
        self
    }

    /// Adds a table; the first column labels the rows, the others are aligned to the right.
    #[must_use]
    pub fn table(mut self, caption: &str, header: &[&str], rows: &[Vec<String>]) -> Self {
        let cells = |tag: &str, row: &mut dyn Iterator<Item = &str>| -> String {
            row.map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell))).collect()
        };
        let head = cells("th", &mut header.iter().copied());
        self.body += "<div class=\"wide\"><table>\n";
        self.body +=
            &format!("<caption>{}</caption>\n<thead><tr>{head}</tr></thead>\n<tbody>\n", escaped(caption));
        for row in rows {
            self.body += &format!("<tr>{}</tr>\n", cells("td", &mut row.iter().map(String::as_str)));
        }
        self.body += "</tbody></table></div>\n";
        self
    }

    /// Adds pictures side by side, as many in a row as there is room for.
    #[must_use]
    pub fn figures(mut self, figures: &[Figure]) -> Self {
        self.body += "<div class=\"figures\">\n";
        for Figure { png, caption, legend } in figures {
            let data = base64::engine::general_purpose::STANDARD.encode(png);
            let caption = escaped(caption);
            let legend = legend.as_ref().map_or(String::new(), legend_bar);
            self.body += &format!(
                "<figure><img alt=\"{caption}\" src=\"data:image/png;base64,{data}\">{legend}<figcaption>{caption}</figcaption></figure>\n"
            );
        }
        self.body += "</div>\n";
        self
    }

    /// Adds a page of its own to turn and compute on, as `ndf view` writes it.
    #[must_use]
    pub fn viewer(mut self, caption: &str, page: &str) -> Self {
        let (caption, page) = (escaped(caption), escaped(page));
        self.body += &format!(
            "<figure class=\"viewer\"><iframe title=\"{caption}\" loading=\"lazy\" srcdoc=\"{page}\"></iframe><figcaption>{caption}</figcaption></figure>\n"
        );
        self.has_viewer = true;
        self
    }

    /// Adds counts, each with its name and the class of its colour, above a bar in which each has its share.
    #[must_use]
    pub fn shares(mut self, counts: &[(&str, &str, usize)]) -> Self {
        self.body += "<div class=\"tiles\">";
        for (name, class, count) in counts {
            let (name, class) = (escaped(name), escaped(class));
            self.body += &format!("<p><b>{}</b><i class=\"{class}\"></i> {name}</p>", grouped(*count));
        }
        self.body += "</div>\n<div class=\"shares\">";
        for (name, class, count) in counts.iter().filter(|(_, _, count)| *count > 0) {
            let (name, class) = (escaped(name), escaped(class));
            self.body += &format!("<i class=\"{class}\" style=\"flex-grow:{count}\" title=\"{name}\"></i>");
        }
        self.body += "</div>\n";
        self
    }

    /// Adds histograms side by side, as many in a row as there is room for.
    #[must_use]
    pub fn spreads(mut self, spreads: &[Spread]) -> Self {
        self.body += "<div class=\"spreads\">\n";
        for spread in spreads {
            let ends: String = spread
                .in_words()
                .iter()
                .map(|(name, value)| format!("<span>{name}<b>{}</b></span>", escaped(value)))
                .collect();
            let scale = if spread.is_logarithmic() { " <small>logarithmic</small>" } else { "" };
            self.body += &format!(
                "<figure class=\"spread\"><h3>{}{scale}</h3>{}<figcaption>{ends}</figcaption></figure>\n",
                escaped(&spread.title),
                spread.svg()
            );
        }
        self.body += "</div>\n";
        self
    }

    /// Adds pairs of pictures of so many columns and rows.
    #[must_use]
    pub fn pairs(mut self, size: [usize; 2], pairs: &[Pair]) -> Self {
        let [width, height] = size;
        self.body += "<div class=\"pairs\">\n";
        for Pair { pictures, caption } in pairs {
            let caption = escaped(caption);
            self.body += "<figure><div>";
            for picture in pictures {
                self.body += &match picture {
                    Ok(png) => {
                        let data = base64::engine::general_purpose::STANDARD.encode(png);
                        format!(
                            "<img alt=\"\" width=\"{width}\" height=\"{height}\" src=\"data:image/png;base64,{data}\">"
                        )
                    }
                    Err(why) => format!("<p>{}</p>", escaped(why)),
                };
            }
            self.body += &format!("</div><figcaption>{caption}</figcaption></figure>\n");
        }
        self.body += "</div>\n";
        self
    }

    /// Adds a list of counts of things with what they are, and examples.
    #[must_use]
    pub fn counted(mut self, items: &[(usize, String, String)]) -> Self {
        self.body += "<ul class=\"counted\">\n";
        for (count, what, examples) in items {
            let (count, what, examples) = (grouped(*count), escaped(what), escaped(examples));
            self.body += &format!("<li><b>{count} ×</b><div>{what}<small>{examples}</small></div></li>\n");
        }
        self.body += "</ul>\n";
        self
    }

    /// The page.
    pub fn to_html(&self) -> String {
        let Self { title, body, has_viewer } = self;
        // A page inside is bound by what its frame may do.
        let computing = if *has_viewer {
            "; script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:; worker-src blob:; img-src data: blob:"
        } else {
            "; img-src data:"
        };
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'{computing}\">\n\
             <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n<h1>{title}</h1>\n{body}</main>\n</body>\n</html>\n"
        )
    }
}

/// A bar of the colours with the values at its ends.
fn legend_bar(legend: &Legend) -> String {
    let stops: Vec<String> = legend.stops.iter().map(|[r, g, b]| format!("rgb({r},{g},{b})")).collect();
    let (low, high) = (readable(legend.low), readable(legend.high));
    format!(
        "<div class=\"legend\"><span>{low}</span><i style=\"background:linear-gradient(to right,{})\"></i><span>{high}</span></div>",
        stops.join(",")
    )
}

/// Text that HTML shows as it stands, in elements and in quoted attributes.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\'' => out += "&#39;",
            _ => out.push(c),
        }
    }
    out
}

const STYLE: &str = include_str!("report.css");

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_adds_markup() {
        let evil = "</style></title><script>alert('1')</script>\" onload=\"x & y";
        let figure = Figure { png: vec![1, 2, 3], caption: evil.into(), legend: None };
        let page = Report::new(evil)
            .heading(evil)
            .paragraph(evil)
            .code(evil)
            .table(evil, &[evil], &[vec![evil.into()]])
            .figures(&[figure])
            .viewer(evil, "")
            .to_html();
        assert!(!page.contains("<script") && !page.contains("\" onload"));
        assert_eq!(page.matches("</style>").count(), 1);
        assert_eq!(page.matches("&lt;script&gt;").count(), 12);
    }

    #[test]
    fn a_painted_mesh_becomes_a_figure_with_its_legend() {
        let mesh = ndf_mesh::shapes::icosphere(2);
        let values = mesh.positions().iter().map(|p| p.y as f32).collect();
        let height = VertexScalars { name: "height".into(), values };
        let shot = Shot { width: 60, height: 40, ..Shot::default() };
        let figure = Figure::of_mesh(
            &mesh,
            Some((&height, ColourMap::of(&height.values))),
            "height",
            &shot,
            &ndf_core::NoProgress,
        )
        .unwrap();
        assert!(figure.png.starts_with(b"\x89PNG"));
        let legend = figure.legend.unwrap();
        assert_eq!((legend.low, legend.high, legend.stops.len()), (-1.0, 1.0, 17));
        // Blue, white, red.
        assert!(legend.stops[0][2] > legend.stops[0][0] && legend.stops[16][0] > legend.stops[16][2]);
    }

    #[test]
    fn only_a_viewer_may_run_scripts() {
        let plain = Report::new("A run");
        assert!(!plain.to_html().contains("script"));
        let page = plain.viewer("A knot", "<script>a && b</script>").to_html();
        assert!(
            page.contains("srcdoc=\"&lt;script&gt;a &amp;&amp; b&lt;/script&gt;\"")
                && page.contains("script-src")
        );
    }

    #[test]
    fn the_page_stands_alone() {
        let legend = Legend { low: -1.0, high: 2.5, stops: vec![[0, 0, 255], [255, 0, 0]] };
        let figure = Figure { png: b"\x89PNG".to_vec(), caption: "a knot".into(), legend: Some(legend) };
        let page = Report::new("A run").figures(&[figure]).to_html();
        assert!(page.contains("src=\"data:image/png;base64,iVBORw==\""));
        assert!(page.contains("rgb(0,0,255),rgb(255,0,0)") && page.contains("<span>2.500</span>"));
        for outside in ["http://", "https://", "src=\"/", "@import", "url("] {
            assert!(!page.contains(outside), "{outside}");
        }
    }
}
