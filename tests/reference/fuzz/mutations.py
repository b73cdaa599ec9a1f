"""Mutations of texts and binaries: bytes, spans, tokens, numbers, encodings. All take a `random.Random` and bytes, and give bytes."""
import re

NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
TOKEN = re.compile(rb"[A-Za-z_$][A-Za-z0-9_$]*|[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[^\sA-Za-z0-9_]")
EXTREMES = [b"1e308", b"-1e308", b"1e309", b"-0", b"nan", b"NaN", b"inf", b"-inf", b"", b"1e-320", b"0", b"1", b"-1", b"360", b"1e5", b"180",
            b"999999999999999999999999", b"-9223372036854775809", b"18446744073709551616", b"0x10", b"1_000", b"1.2.3", b"1e", b"--5", b"+5",
            b".5", b"5.", b"1,5", b"1e400", b"4294967296", b"null", b"true", b"9E9", b"\xd9\xa3", b"1e-5", b"0.1e+2", b"1d3", b"1 e3"]
SEPARATORS = [b",", b";", b" ", b"\t", b"\n", b"\r\n", b"\r", b":", b"{", b"}", b"[", b"]", b"\"", b"'", b"#", b"!", b"(", b")", b"=", b"<", b">", b"/",
              b"&", b"-", b"+", b".", b"\\", b"\0", b"\xa0", b"\xc2\xa0", b"\xe2\x80\x8b", b"\xef\xbb\xbf", b"\x1a", b"\x0b", b"\x0c", b"*", b"|", b"~"]


def flip(r, data):
    data = bytearray(data)
    for _ in range(r.choice((1, 1, 1, 2, 8))):
        bit = r.randrange(len(data) * 8)
        data[bit // 8] ^= 1 << (bit % 8)
    return bytes(data)


def put(r, data):
    at = r.randrange(len(data))
    return data[:at] + bytes([r.choice((0, 255, 127, 128, r.randrange(256)))]) + data[at + 1:]


def span(r, data, longest):
    at = r.randrange(len(data))
    return at, min(len(data), at + 1 + int(longest ** r.random()))


def delete(r, data):
    a, b = span(r, data, 64)
    return data[:a] + data[b:]


def insert(r, data):
    at = r.randrange(len(data) + 1)
    piece = r.choice((r.choice(SEPARATORS), bytes(r.randrange(256) for _ in range(r.randrange(1, 9)))))
    return data[:at] + piece + data[at:]


def duplicate(r, data):
    a, b = span(r, data, 512)
    at = r.choice((b, r.randrange(len(data))))
    return data[:at] + data[a:b] * r.choice((1, 1, 2, 50)) + data[at:]


def truncate(r, data):
    return data[: r.randrange(len(data))]


def swap(r, data):
    found = [m.span() for m in TOKEN.finditer(data)]
    if len(found) < 2:
        return data
    (a, b), (c, d) = sorted(r.sample(found, 2))
    return data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]


def swap_neighbours(r, data):
    found = [m.span() for m in TOKEN.finditer(data)]
    if len(found) < 2:
        return data
    k = r.randrange(len(found) - 1)
    (a, b), (c, d) = found[k], found[k + 1]
    return data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]


def drop_token(r, data):
    found = [m.span() for m in TOKEN.finditer(data)]
    if not found:
        return data
    a, b = r.choice(found)
    return data[:a] + data[b:]


def one_number(r, data, change):
    found = [m.span() for m in NUMBER.finditer(data)]
    if not found:
        return data
    a, b = r.choice(found)
    return data[:a] + change(data[a:b]) + data[b:]


def extreme(r, data):
    return one_number(r, data, lambda _: r.choice(EXTREMES))


def blank_inside(r, data):
    def change(text):
        at = r.randrange(len(text) + 1)
        return text[:at] + r.choice((b" ", b" ", b"\t", b"  ", b"\n", b"\r", b"\xc2\xa0", b"_", b",", b".", b"'")) + text[at:]
    return one_number(r, data, change)


def digits(r, data):
    def change(text):
        at = r.randrange(len(text) + 1)
        return text[:at] + r.choice((b"0", b"9", b"e5", b"-", b"+", b".", b"000000000000000000000", b" - ")) + text[at:]
    return one_number(r, data, change)


def other_value(r, data):
    return one_number(r, data, lambda _: b"%.*f" % (r.randrange(7), r.uniform(-180, 180) * r.choice((0.01, 1, 1, 10))))


def line_ends(r, data):
    plain = data.replace(b"\r\n", b"\n")
    return plain.replace(b"\n", r.choice((b"\r\n", b"\r", b"\n\n", b"\r\r\n", b"\n\r")))


def encoding(r, data):
    way = r.randrange(5)
    text = data.decode("latin-1")
    if way == 0:
        return b"\xef\xbb\xbf" + data
    if way == 1:
        return text.encode("utf-16")
    if way == 2:
        return text.encode("utf-16-le")
    at = r.randrange(len(data) + 1)
    return data[:at] + (b"\xfc" if way == 3 else "\u00fc\u2212\u0663".encode()) + data[at:]


def lines(r, data):
    rows = data.split(b"\n")
    a, b = r.randrange(len(rows)), r.randrange(len(rows))
    way = r.randrange(4)
    if way == 0:
        rows[a], rows[b] = rows[b], rows[a]
    elif way == 1:
        rows.insert(a, rows[b])
    elif way == 2:
        del rows[a]
    else:
        rows[a:a + 1] = [rows[a], b""]
    return b"\n".join(rows)


def deep(r, data):
    at = r.randrange(len(data) + 1)
    opening = r.choice((b"[", b"{", b"(", b"<a>", b"- ", b"{a: ", b"[[", b"\"", b"&a [*a,"))
    return data[:at] + opening * r.choice((3, 100, 20_000)) + data[at:]


def word(words):
    """Puts one word of the language somewhere."""
    def change(r, data):
        piece = r.choice(words)
        found = [m.span() for m in TOKEN.finditer(data)]
        if not found or r.random() < 0.3:
            at = r.randrange(len(data) + 1)
            return data[:at] + piece + data[at:]
        a, b = r.choice(found)
        return data[:a] + piece + (b"" if r.random() < 0.6 else b" " + data[a:b]) + data[b:]
    return change


def zeros(r, data):
    a, b = span(r, data, 256)
    return data[:a] + bytes([r.choice((0, 255))]) * (b - a) + data[b:]


def count(r, data):
    """A length or count of four bytes becomes another."""
    at = r.randrange(max(1, len(data) - 4))
    value = r.choice((0, 1, 0x7fffffff, 0xffffffff, 0x80000000, r.randrange(1 << 32)))
    return data[:at] + value.to_bytes(4, "little") + data[at + 4:]


TEXT = [(flip, 2), (put, 2), (delete, 3), (insert, 3), (duplicate, 2), (truncate, 1), (swap, 3), (swap_neighbours, 4), (drop_token, 4),
        (extreme, 5), (blank_inside, 6), (digits, 4), (other_value, 6), (line_ends, 1), (encoding, 1), (lines, 3), (deep, 0.4)]
BINARY = [(flip, 12), (put, 6), (delete, 2), (insert, 2), (duplicate, 1), (truncate, 1), (zeros, 3), (count, 6)]


def mutated(r, data, ways):
    """One to three mutations, most often one."""
    for _ in range(r.choice((1, 1, 1, 1, 2, 3))):
        if data:
            way = r.choices([w for w, _ in ways], [weight for _, weight in ways])[0]
            data = way(r, data)
    return data
