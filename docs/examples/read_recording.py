#!/usr/bin/env python3
"""Reads a recording of `phantom3 run --record OUT.mcap` with the public MCAP reader.

    python3 -m venv venv && venv/bin/pip install mcap mcap-protobuf-support
    venv/bin/python docs/examples/read_recording.py OUT.mcap

Prints who made it, what happened, and for each finger how long it touched and what it felt. With `--against OTHER.csv`
every number is compared with a table that the same run wrote (`--record OUT.mcap --record OTHER.csv`). A recording that
was cut short, by a full disk or a kill, is read as far as it is whole.
"""

import argparse
import csv
import json
import math
import sys

from mcap.exceptions import EndOfFile, McapError
from mcap.reader import NonSeekingReader
from mcap.records import Metadata
from mcap.stream_reader import StreamReader
from mcap_protobuf.decoder import DecoderFactory


def facts(path):
    """The metadata by name, and the names of the attached files. They stand before the first tick."""
    found, files = {}, []
    with open(path, "rb") as stream:
        try:
            for record in StreamReader(stream).records:
                if isinstance(record, Metadata):
                    found[record.name] = record.metadata
                elif type(record).__name__ == "Attachment":
                    files.append(record.name)
        except (EndOfFile, McapError):
            pass
    return found, files


def messages(path, topics):
    """Decoded messages in the order of the file, up to where it ends, be it in the middle."""
    with open(path, "rb") as stream:
        reader = NonSeekingReader(stream, decoder_factories=[DecoderFactory()])
        try:
            # The file is in the order of time already; sorting would need its end.
            for _, channel, message, decoded in reader.iter_decoded_messages(topics, log_time_order=False):
                yield channel.topic, decoded
        except (EndOfFile, McapError) as error:
            print(f"(cut short: {type(error).__name__}; what is whole was read)", file=sys.stderr)


def norm(v):
    return math.sqrt(v.x * v.x + v.y * v.y + v.z * v.z)


def summary(path):
    found, files = facts(path)
    run, columns = found["phantom3.run"], found["phantom3.columns"]
    print(f"{run['program']}, {run['clock']} clock, {1e9 / int(run['period_ns']):g} Hz, scene {run['scene']}")
    print(f"arguments: {' '.join(json.loads(run['arguments']))}")
    print(f"attached: {', '.join(files) or 'nothing'}")
    fingers = json.loads(columns["fingers"])
    fields = dict(zip(fingers, json.loads(columns["fields"])))
    felt = {name: [] for name in fingers}
    ticks = 0
    for topic, message in messages(path, ["/tick", "/events"]):
        if topic == "/events":
            print(f"  {message.t:8.3f} s  {message.finger:8} {message.kind:14} {message.entity:12} {message.value:.3f}")
            continue
        ticks += 1
        for name in fingers:
            finger = getattr(message, fields[name])
            if finger.entity:
                felt[name].append(norm(finger.force))
    for name, forces in felt.items():
        mean = sum(forces) / len(forces) if forces else 0.0
        print(f"{name}: touches in {len(forces)} of {ticks} ticks, {mean:.3f} N in the mean, {max(forces, default=0.0):.3f} N at most")
    end = found.get("phantom3.end")
    print(f"complete: {end['rows']} rows, {end['rows_lost']} lost" if end else "not complete: the recorder did not end it")


def compare(path, table):
    """Every HIP, god-object, force and word of the table stands in the recording, to the bit."""
    found, _ = facts(path)
    columns = found["phantom3.columns"]
    fields = dict(zip(json.loads(columns["fingers"]), json.loads(columns["fields"])))
    rows = 0
    with open(table, newline="") as stream:
        for (_, tick), row in zip(messages(path, ["/tick"]), csv.DictReader(stream), strict=True):
            assert tick.t == float(row["t"]), (tick.t, row["t"])
            for name, field in fields.items():
                finger = getattr(tick, field)
                for quantity in ("hip", "god", "force", "applied"):
                    for axis in "xyz":
                        there = float(row[f"{name}_{quantity}_{axis}"])
                        assert getattr(getattr(finger, quantity), axis) == there, (row["t"], name, quantity, axis)
                for word in ("entity", "feature", "friction"):
                    assert getattr(finger, word) == row[f"{name}_{word}"], (row["t"], name, word)
            rows += 1
    print(f"{rows} rows are the same in {path} and {table}")


def main():
    parser = argparse.ArgumentParser(description="Reads a recording of phantom3.")
    parser.add_argument("recording")
    parser.add_argument("--against", metavar="CSV")
    arguments = parser.parse_args()
    summary(arguments.recording)
    if arguments.against:
        compare(arguments.recording, arguments.against)


if __name__ == "__main__":
    main()
