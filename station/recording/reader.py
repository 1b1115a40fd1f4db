"""The door for whoever reads recordings: what opens one, what it hands out, and its digest.

| module | tells |
|---|---|
| `opening.py` | whether a file is a finished recording, and which parts belong to it |
| `file_reader.py`, `parted.py` | what is in one file, and in several as one |
| `in_order.py`, `in_batches.py` | its messages one by one by log time, or many at a time as they stand in the file |
| `recording_info.py` | what its index tells, without reading a message |
| `indexed.py`, `described.py` | its chunks; its metadata and attached files |
| `recorded.py` | what a topic and a message of it are |
"""

from station.recording.digest import digest
from station.recording.file_reader import RecordingReader
from station.recording.opening import open_file, open_recording
from station.recording.recorded import TRUTH, Recorded, TopicInfo

__all__ = ["TRUTH", "Recorded", "RecordingReader", "TopicInfo", "digest", "open_file", "open_recording"]
