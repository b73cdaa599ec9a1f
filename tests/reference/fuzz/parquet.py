"""A small reader of flat Parquet files, of its own: numbers of columns that are not compressed, plain or by dictionary."""
import struct


class Unknown(Exception):
    """What this reader does not know, or a damaged file."""


class Compact:
    """Thrift's compact protocol as nested dictionaries by field number."""

    def __init__(self, data, at=0):
        self.data, self.at = data, at

    def byte(self):
        self.at += 1
        return self.data[self.at - 1]

    def varint(self):
        out = shift = 0
        while True:
            b = self.byte()
            out |= (b & 127) << shift
            if b < 128:
                return out
            shift += 7
            if shift > 70:
                raise Unknown("varint")

    def signed(self):
        n = self.varint()
        return (n >> 1) ^ -(n & 1)

    def value(self, kind):
        if kind in (1, 2):
            return kind == 1
        if kind == 3:
            return self.byte()
        if kind in (4, 5, 6):
            return self.signed()
        if kind == 7:
            self.at += 8
            return struct.unpack_from("<d", self.data, self.at - 8)[0]
        if kind == 8:
            n = self.varint()
            if self.at + n > len(self.data):
                raise Unknown("length")
            self.at += n
            return self.data[self.at - n:self.at]
        if kind in (9, 10):
            head = self.byte()
            n = head >> 4
            if n == 15:
                n = self.varint()
            if n > len(self.data):
                raise Unknown("count")
            inner = head & 15
            return [self.byte() == 1 if inner in (1, 2) else self.value(inner) for _ in range(n)]
        if kind == 12:
            return self.struct()
        raise Unknown(f"type {kind}")

    def struct(self):
        out, number = {}, 0
        while True:
            head = self.byte()
            if head == 0:
                return out
            number = number + (head >> 4) if head >> 4 else self.signed()
            out[number] = self.value(head & 15)


def hybrid(data, width, count):
    """Runs of RLE and bit-packed numbers."""
    out, at = [], 0
    whole = (width + 7) // 8
    reader = Compact(data)
    while len(out) < count:
        reader.at = at
        head = reader.varint()
        at = reader.at
        if head & 1:
            n = (head >> 1) * 8
            bits = int.from_bytes(data[at:at + n * width // 8], "little")
            out += [(bits >> (k * width)) & ((1 << width) - 1) for k in range(min(n, count - len(out)))]
            at += n * width // 8
        else:
            out += [int.from_bytes(data[at:at + whole], "little")] * min(head >> 1, count - len(out))
            at += whole
            if head >> 1 == 0:
                raise Unknown("empty run")
    return out


def plain(kind, data, count):
    form = {1: "i", 2: "q", 4: "f", 5: "d"}.get(kind)
    if form is None:
        raise Unknown(f"physical type {kind}")
    return list(struct.unpack_from(f"<{count}{form}", data))


def chunk(data, meta, optional):
    if meta[4] != 0:
        raise Unknown("compressed")
    kind, left, out, table = meta[1], meta[5], [], None
    at = meta.get(11) or meta[9]
    while left > 0:
        reader = Compact(data, at)
        page = reader.struct()
        body, at = data[reader.at:reader.at + page[3]], reader.at + page[3]
        if page[1] == 2:
            table = plain(kind, body, page[7][1])
            continue
        if page[1] != 0:
            raise Unknown(f"page type {page[1]}")
        count, encoding = page[5][1], page[5][2]
        if count > 1 << 20:
            raise Unknown("too many values")
        there = [1] * count
        if optional:
            n = struct.unpack_from("<I", body)[0]
            there = hybrid(body[4:4 + n], 1, count)
            body = body[4 + n:]
        filled = sum(there)
        if encoding == 0:
            values = plain(kind, body, filled)
        elif encoding in (2, 8) and table is not None:
            values = [table[i] for i in hybrid(body[1:], body[0], filled)] if body[0] else [table[0]] * filled
        else:
            raise Unknown(f"encoding {encoding}")
        values = iter(values)
        out += [next(values) if x else None for x in there]
        left -= count
    return out


def columns(data):
    """Name -> values of every column of numbers; other columns are left out."""
    try:
        size = struct.unpack("<I", data[-8:-4])[0]
        meta = Compact(data, len(data) - 8 - size).struct()
        leaves = [s for s in meta[2][1:]]
        out = {s[4].decode(): [] for s in leaves if s.get(1) in (1, 2, 4, 5)}
        for group in meta[4]:
            for leaf, column in zip(leaves, group[1]):
                name = leaf[4].decode()
                if name in out:
                    out[name] += chunk(data, column[3], leaf.get(3) == 1)
        return out
    except Unknown:
        raise
    except (KeyError, IndexError, ValueError, TypeError, struct.error, AttributeError, OverflowError, MemoryError, RecursionError, StopIteration,
            RuntimeError) as error:
        raise Unknown(repr(error)) from error
