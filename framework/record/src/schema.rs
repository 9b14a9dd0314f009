//! Protobuf schemas from the names of variables, and the encoding of samples.
//!
//! `state.position.x` becomes a message `State { Position { double x } }`; `rate[0]`, `rate[1]` become `repeated double rate`. Proto3 without
//! presence: readers return 0 for an absent field, so every number is written, including zero.
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet};

/// One field of a message: a number, numbers, or a message.
#[derive(Clone, Debug, PartialEq)]
enum Node {
    Number(usize),
    Truth(usize),
    Numbers(Vec<usize>),
    Message(Vec<(String, Node)>),
}

/// A message type with the columns of its fields.
#[derive(Clone, Debug, PartialEq)]
pub struct Schema {
    /// Full name of the message type.
    pub name: String,
    fields: Vec<(String, Node)>,
}

impl Schema {
    /// Creates the schema from the variables' names relative to their part, in column order. `truth` marks booleans.
    pub fn new(name: &str, columns: &[(String, bool)]) -> Schema {
        let mut fields = Vec::new();
        for (k, (column, truth)) in columns.iter().enumerate() {
            let path: Vec<&str> = column.split('.').collect();
            insert(&mut fields, &path, k, *truth);
        }
        Schema { name: format!("linkwork.{}", camel(name)), fields }
    }

    /// Returns the serialized `FileDescriptorSet` for MCAP.
    pub fn descriptor(&self) -> Vec<u8> {
        let short = self.name.trim_start_matches("linkwork.").to_string();
        let file = FileDescriptorProto {
            name: Some(format!("{}.proto", self.name)),
            package: Some("linkwork".into()),
            message_type: vec![message(&short, &format!(".{}", self.name), &self.fields)],
            syntax: Some("proto3".into()),
            ..FileDescriptorProto::default()
        };
        prost::Message::encode_to_vec(&FileDescriptorSet { file: vec![file] })
    }

    /// Returns the columns, and their names in [`decode`].
    pub fn columns(&self) -> Vec<(usize, String)> {
        let mut out = Vec::new();
        columns(&self.fields, "", &mut out);
        out
    }

    /// Appends the message of a sample.
    pub fn encode(&self, row: &[f64], out: &mut Vec<u8>) {
        encode(&self.fields, row, out);
    }
}

fn columns(fields: &[(String, Node)], prefix: &str, out: &mut Vec<(usize, String)>) {
    for (name, node) in fields {
        let path = format!("{prefix}{name}");
        match node {
            Node::Number(c) | Node::Truth(c) => out.push((*c, path)),
            Node::Numbers(list) => {
                out.extend(list.iter().zip(0..).map(|(c, k)| (*c, format!("{path}[{k}]"))));
            }
            Node::Message(inner) => columns(inner, &format!("{path}."), out),
        }
    }
}

fn insert(fields: &mut Vec<(String, Node)>, path: &[&str], column: usize, truth: bool) {
    let (head, rest) = (path[0], &path[1..]);
    let stem = head.split('[').next().unwrap_or(head);
    let indexed = stem.len() < head.len();
    let name = identifier(stem);
    if rest.is_empty() {
        if indexed {
            if let Some((_, Node::Numbers(list))) = fields.iter_mut().find(|(n, _)| *n == name) {
                list.push(column);
                return;
            }
            fields.push((name, Node::Numbers(vec![column])));
        } else {
            let name = free(fields, name);
            fields.push((name, if truth { Node::Truth(column) } else { Node::Number(column) }));
        }
        return;
    }
    let name = if indexed { identifier(head) } else { name };
    if let Some((_, Node::Message(inner))) = fields.iter_mut().find(|(n, _)| *n == name) {
        insert(inner, rest, column, truth);
        return;
    }
    let mut inner = Vec::new();
    insert(&mut inner, rest, column, truth);
    let name = free(fields, name);
    fields.push((name, Node::Message(inner)));
}

/// Returns the name, with a suffix if another field has it: two names can map to the same identifier.
fn free(fields: &[(String, Node)], mut name: String) -> String {
    while fields.iter().any(|(n, _)| *n == name) {
        name.push('_');
    }
    name
}

fn identifier(text: &str) -> String {
    let mut out: String =
        text.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    while out.ends_with('_') {
        out.pop();
    }
    if out.starts_with(|c: char| c.is_ascii_digit()) || out.is_empty() {
        out.insert(0, '_');
    }
    out
}

fn camel(text: &str) -> String {
    text.split(|c: char| !c.is_ascii_alphanumeric())
        .map(|w| {
            let mut c = w.chars();
            c.next().map_or(String::new(), |f| f.to_uppercase().chain(c).collect())
        })
        .collect()
}

fn message(name: &str, full: &str, fields: &[(String, Node)]) -> DescriptorProto {
    let mut out = DescriptorProto { name: Some(name.into()), ..DescriptorProto::default() };
    for (k, (field, node)) in fields.iter().enumerate() {
        let mut f = FieldDescriptorProto {
            name: Some(field.clone()),
            number: Some(k as i32 + 1),
            label: Some(Label::Optional as i32),
            r#type: Some(Type::Double as i32),
            ..FieldDescriptorProto::default()
        };
        match node {
            Node::Number(_) => {}
            Node::Truth(_) => f.r#type = Some(Type::Bool as i32),
            Node::Numbers(_) => f.label = Some(Label::Repeated as i32),
            Node::Message(inner) => {
                let nested = format!("{}Message", camel(field));
                f.r#type = Some(Type::Message as i32);
                f.type_name = Some(format!("{full}.{nested}"));
                out.nested_type.push(message(&nested, &format!("{full}.{nested}"), inner));
            }
        }
        out.field.push(f);
    }
    out
}

fn varint(mut v: u64, out: &mut Vec<u8>) {
    while v >= 0x80 {
        out.push(v as u8 | 0x80);
        v >>= 7;
    }
    out.push(v as u8);
}

fn encode(fields: &[(String, Node)], row: &[f64], out: &mut Vec<u8>) {
    for (k, (_, node)) in fields.iter().enumerate() {
        let tag = (k as u64 + 1) << 3;
        match node {
            Node::Number(c) => {
                varint(tag | 1, out);
                out.extend(row[*c].to_le_bytes());
            }
            Node::Truth(c) => {
                varint(tag, out);
                out.push(u8::from(row[*c] > 0.5));
            }
            Node::Numbers(list) => {
                varint(tag | 2, out);
                varint(8 * list.len() as u64, out);
                for c in list {
                    out.extend(row[*c].to_le_bytes());
                }
            }
            Node::Message(inner) => {
                varint(tag | 2, out);
                varint(length(inner) as u64, out);
                encode(inner, row, out);
            }
        }
    }
}

fn length(fields: &[(String, Node)]) -> usize {
    let size = |v: usize| {
        let mut b = Vec::new();
        varint(v as u64, &mut b);
        b.len()
    };
    fields
        .iter()
        .enumerate()
        .map(|(k, (_, node))| {
            size((k + 1) << 3)
                + match node {
                    Node::Number(_) => 8,
                    Node::Truth(_) => 1,
                    Node::Numbers(l) => size(8 * l.len()) + 8 * l.len(),
                    Node::Message(inner) => {
                        let n = length(inner);
                        size(n) + n
                    }
                }
        })
        .sum()
}

/// Decodes a message into named numbers with its descriptor, for `diff` and for tests.
pub fn decode(descriptor: &FileDescriptorSet, type_name: &str, data: &[u8]) -> Vec<(String, f64)> {
    let short = type_name.rsplit('.').next().unwrap_or(type_name);
    let found = descriptor.file.iter().flat_map(|f| &f.message_type).find(|m| m.name() == short);
    let mut out = Vec::new();
    if let Some(m) = found {
        decode_message(m, "", data, &mut out);
    }
    out
}

fn take_varint(data: &[u8], at: &mut usize) -> Option<u64> {
    let mut v = 0u64;
    for shift in (0..64).step_by(7) {
        let b = *data.get(*at)?;
        *at += 1;
        v |= u64::from(b & 0x7f) << shift;
        if b < 0x80 {
            return Some(v);
        }
    }
    None
}

fn decode_message(m: &DescriptorProto, prefix: &str, data: &[u8], out: &mut Vec<(String, f64)>) {
    let mut at = 0;
    while at < data.len() {
        let Some(tag) = take_varint(data, &mut at) else { return };
        let field = m.field.iter().find(|f| f.number() as u64 == tag >> 3);
        let name = field.map_or("?", |f| f.name());
        let path = if prefix.is_empty() { name.to_string() } else { format!("{prefix}.{name}") };
        match tag & 7 {
            0 => {
                let Some(v) = take_varint(data, &mut at) else { return };
                out.push((path, v as f64));
            }
            1 => {
                let Some(bytes) = data.get(at..).and_then(|d| d.get(..8)) else { return };
                at += 8;
                out.push((path, f64::from_le_bytes(bytes.try_into().unwrap_or_default())));
            }
            5 => at += 4,
            2 => {
                let Some(n) = take_varint(data, &mut at) else { return };
                let end = usize::try_from(n).ok().and_then(|n| at.checked_add(n));
                let Some(body) = end.and_then(|end| data.get(at..end)) else { return };
                at += body.len();
                let Some(f) = field else { continue };
                if f.r#type() == Type::Double {
                    for (k, b) in body.as_chunks::<8>().0.iter().enumerate() {
                        out.push((format!("{path}[{k}]"), f64::from_le_bytes(*b)));
                    }
                } else if f.r#type() == Type::Message {
                    let short = f.type_name().rsplit('.').next().unwrap_or_default();
                    if let Some(inner) = m.nested_type.iter().find(|n| n.name() == short) {
                        decode_message(inner, &path, body, out);
                    }
                }
            }
            _ => return,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_by_name() {
        let names =
            ["torque", "hub.position.x", "hub.position.y", "rate[0]", "rate[1]", "on", "hub.w"];
        let columns: Vec<(String, bool)> =
            names.iter().map(|n| (n.to_string(), *n == "on")).collect();
        let s = Schema::new("Rover.Wheels.Wheel1/Motor", &columns);
        let row = [1.5, -0.0, f64::NAN, 3.0, f64::INFINITY, 1.0, 9.0];
        let mut bytes = Vec::new();
        s.encode(&row, &mut bytes);
        let set: FileDescriptorSet = prost::Message::decode(s.descriptor().as_slice()).unwrap();
        let back = decode(&set, &s.name, &bytes);
        assert_eq!(s.name, "linkwork.RoverWheelsWheel1Motor");
        assert_eq!(back.len(), 7);
        for (column, name) in s.columns() {
            let found = back.iter().find(|(n, _)| *n == name).unwrap().1;
            assert_eq!(found.to_bits(), row[column].to_bits(), "{name}");
        }
        for (name, value) in names.iter().zip(row) {
            let found = back.iter().find(|(n, _)| n == name).unwrap().1;
            assert_eq!(found.to_bits(), value.to_bits(), "{name}");
        }
    }
}
