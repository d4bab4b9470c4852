//! Free-form surfaces in Wavefront OBJ: the part of them that is B-splines and Bezier patches without holes.
//!
//! Read: `v x y z w`, `cstype bspline` and `cstype bezier`, with `rat` before it or not, `deg`, `surf`, `parm u`, `parm v`,
//! `end`. Without `rat` weights do not count. Of a Bezier surface `parm` tells where segments begin and end; it is the
//! B-spline that has each of these knots as often as its degree, and the outer ones once more. Ignored: what an OBJ of polygons may have besides, curves (`curv`, `curv2` and what belongs to them), and hints
//! on connection and tessellation. Refused: other kinds of surfaces, trimming, holes, a part of a surface, polygons.

use super::obj::{FREE_FORM, IGNORED, Statements, integer, words};
use super::{ModelError, number, shown};
use haptics::{NurbsError, NurbsPatch};

/// Reads the free-form surfaces of an OBJ file.
///
/// # Errors
/// The first thing found to be wrong, with its line.
pub fn read_free_form(bytes: &[u8]) -> Result<Vec<NurbsPatch>, ModelError> {
    let mut reader = Reader::default();
    for (line, statement) in Statements::new(bytes) {
        let words: Vec<&[u8]> = words(&statement).collect();
        if let Some((keyword, rest)) = words.split_first() {
            reader.statement(line, keyword, rest)?;
        }
    }
    if let Some(surf) = &reader.open {
        return refused(surf.line, "a surface without an end", "`end` behind its `parm` statements");
    }
    if reader.patches.is_empty() { Err(ModelError::NoPatch) } else { Ok(reader.patches) }
}

#[derive(Default)]
struct Reader {
    vertices: Vec<[f64; 4]>,
    /// `None` before the first `cstype`.
    kind: Option<Kind>,
    degree: Option<[usize; 2]>,
    open: Option<Surf>,
    /// Inside a curve, whose `parm` and `end` are none of ours.
    is_in_curve: bool,
    patches: Vec<NurbsPatch>,
}

/// What `cstype` says.
#[derive(Clone, Copy)]
struct Kind {
    /// Whether weights count.
    is_rational: bool,
    is_bezier: bool,
}

/// A surface before its end.
struct Surf {
    line: usize,
    is_bezier: bool,
    /// First and last parameter along u and v.
    range: [f64; 4],
    points: Vec<[f64; 4]>,
    /// With the line they stand on.
    knots: [Option<(usize, Vec<f64>)>; 2],
}

impl Reader {
    fn statement(&mut self, line: usize, keyword: &[u8], rest: &[&[u8]]) -> Result<(), ModelError> {
        match keyword {
            b"v" => self.vertices.push(vertex(line, rest)?),
            b"cstype" => self.kind = Some(cstype(line, rest)?),
            b"deg" => self.degree = Some(degree(line, rest)?),
            b"surf" => self.open = Some(self.surf(line, rest)?),
            b"curv" | b"curv2" => self.is_in_curve = true,
            b"parm" if !self.is_in_curve => self.parm(line, rest)?,
            b"end" if self.is_in_curve => self.is_in_curve = false,
            b"end" => self.end(line)?,
            b"trim" | b"hole" | b"scrv" => {
                return refused(line, shown(keyword), "whole surfaces: export the model without trimming");
            }
            b"bmat" | b"step" => return refused(line, shown(keyword), CSTYPE),
            b"f" | b"fo" => {
                return refused(
                    line,
                    "a polygon",
                    "free-form surfaces only; polygons are a shape of kind \"mesh\"",
                );
            }
            other if IGNORED.contains(&other) || FREE_FORM.contains(&other) => {}
            other => return refused(line, shown(other), "statements of OBJ, or a comment after `#`"),
        }
        Ok(())
    }

    fn surf(&self, line: usize, rest: &[&[u8]]) -> Result<Surf, ModelError> {
        if self.open.is_some() {
            return refused(line, "a surface within another", "`end` behind each surface");
        }
        let Some(kind) = self.kind.filter(|_| self.degree.is_some()) else {
            return refused(line, "a surface of no kind", "`cstype` and `deg` before the first surface");
        };
        let Some((range, corners)) = rest.split_first_chunk::<4>() else {
            return refused(line, "a surface without parameters", "`surf s0 s1 t0 t1` and its vertices");
        };
        let mut numbers = [0.0; 4];
        for (parsed, word) in numbers.iter_mut().zip(range) {
            *parsed = finite(line, word)?;
        }
        let point = |word: &&[u8]| {
            let [x, y, z, w] = self.vertices[self.index(line, word)?];
            Ok([x, y, z, if kind.is_rational { w } else { 1.0 }])
        };
        let points = corners.iter().map(point).collect::<Result<_, ModelError>>()?;
        Ok(Surf { line, is_bezier: kind.is_bezier, range: numbers, points, knots: [None, None] })
    }

    /// The vertex that a corner such as `7`, `-1` or `7/1/1` names.
    fn index(&self, line: usize, word: &[u8]) -> Result<usize, ModelError> {
        let first = word.split(|&byte| byte == b'/').next().unwrap_or_default();
        let count = self.vertices.len();
        let index = match integer(first) {
            Some(number @ 1..) => usize::try_from(number - 1).ok(),
            Some(number @ ..=-1) => usize::try_from(count as i64 + number).ok(),
            _ => None,
        };
        index.filter(|&index| index < count).map_or_else(
            || refused(line, format!("vertex {}", shown(word)), format!("1 to {count}, or -{count} to -1")),
            Ok,
        )
    }

    fn parm(&mut self, line: usize, rest: &[&[u8]]) -> Result<(), ModelError> {
        let Some(surf) = &mut self.open else {
            return refused(line, "`parm` outside of a surface", "`parm` between `surf` and `end`");
        };
        let direction = match rest.first() {
            Some(&b"u") => 0,
            Some(&b"v") => 1,
            _ => return refused(line, "`parm` without a direction", "`parm u` or `parm v` and numbers"),
        };
        let knots = rest[1..].iter().map(|word| finite(line, word)).collect::<Result<_, _>>()?;
        surf.knots[direction] = Some((line, knots));
        Ok(())
    }

    fn end(&mut self, line: usize) -> Result<(), ModelError> {
        let (Some(surf), Some(degree)) = (self.open.take(), self.degree) else {
            return refused(line, "`end`", "a surface before it");
        };
        let [Some((line_u, u)), Some((line_v, v))] = surf.knots else {
            return refused(line, "a surface without knots", "`parm u` and `parm v` before `end`");
        };
        let mut knots = [u, v];
        if surf.is_bezier {
            for ((knots, degree), line) in knots.iter_mut().zip(degree).zip([line_u, line_v]) {
                *knots = knots_of_segments(line, knots, degree)?;
            }
        }
        let patch = NurbsPatch { degree, knots, points: surf.points };
        patch.check(self.patches.len()).map_err(|error| {
            let NurbsError::Patch { part, found, allowed, .. } = error else {
                return ModelError::Line { line, found: error.to_string(), allowed: "a surface".into() };
            };
            let line = match part.as_str() {
                "knots u" => line_u,
                "knots v" => line_v,
                _ => surf.line,
            };
            ModelError::Line { line, found: format!("{part}: {found}"), allowed }
        })?;
        let ends = |d: usize| {
            let knots = &patch.knots[d];
            [knots[degree[d]], knots[knots.len() - 1 - degree[d]]]
        };
        let whole = [ends(0), ends(1)].concat();
        let tolerance = 1e-6 * (whole[1] - whole[0]).max(whole[3] - whole[2]);
        if whole.iter().zip(&surf.range).any(|(a, b)| (a - b).abs() > tolerance) {
            let found = format!("a part of a surface, {:?}", surf.range);
            return refused(surf.line, found, format!("all of it, {whole:?}"));
        }
        self.patches.push(patch);
        Ok(())
    }
}

/// Of a B-spline that has these segments.
fn knots_of_segments(line: usize, ends: &[f64], degree: usize) -> Result<Vec<f64>, ModelError> {
    const MOST_DEGREE: usize = 64;
    let ([first, .., last], 1..=MOST_DEGREE) = (ends, degree) else {
        let found = format!("{} parameters of a Bezier surface of degree {degree}", ends.len());
        return refused(line, found, "one for each end of a segment, two or more; and a degree of 1 or more");
    };
    let inner = ends.iter().flat_map(|&end| std::iter::repeat_n(end, degree));
    Ok([*first].into_iter().chain(inner).chain([*last]).collect())
}

/// Three coordinates and perhaps a weight; a colour may follow.
fn vertex(line: usize, rest: &[&[u8]]) -> Result<[f64; 4], ModelError> {
    let numbers = rest.iter().map(|word| finite(line, word)).collect::<Result<Vec<_>, _>>()?;
    match numbers[..] {
        [x, y, z] | [x, y, z, _, _, _] => Ok([x, y, z, 1.0]),
        [x, y, z, w] | [x, y, z, w, _, _, _] => Ok([x, y, z, w]),
        _ => refused(
            line,
            format!("a vertex of {} numbers", numbers.len()),
            "three coordinates, and perhaps a weight",
        ),
    }
}

fn cstype(line: usize, rest: &[&[u8]]) -> Result<Kind, ModelError> {
    let (is_rational, name) = match rest {
        [b"rat", name] => (true, *name),
        [name] => (false, *name),
        _ => (false, &b""[..]),
    };
    match name {
        b"bspline" => Ok(Kind { is_rational, is_bezier: false }),
        b"bezier" => Ok(Kind { is_rational, is_bezier: true }),
        _ => refused(line, shown(&rest.join(&b' ')), CSTYPE),
    }
}

fn degree(line: usize, rest: &[&[u8]]) -> Result<[usize; 2], ModelError> {
    let degrees: Vec<usize> =
        rest.iter().filter_map(|word| integer(word)).filter_map(|d| d.try_into().ok()).collect();
    match degrees[..] {
        [u, v] if rest.len() == 2 => Ok([u, v]),
        // Of a curve.
        [u] if rest.len() == 1 => Ok([u, 0]),
        _ => refused(line, shown(&rest.join(&b' ')), "two whole numbers, along u and v"),
    }
}

fn finite(line: usize, word: &[u8]) -> Result<f64, ModelError> {
    number(word).map_or_else(|| refused(line, shown(word), "a finite number"), Ok)
}

fn refused<T>(line: usize, found: impl Into<String>, allowed: impl Into<String>) -> Result<T, ModelError> {
    Err(ModelError::Line { line, found: found.into(), allowed: allowed.into() })
}

const CSTYPE: &str = "`cstype bspline` or `cstype bezier`, with `rat` before the name where weights count";
