// As much of Arduino as the sketch needs, in simulated time: standard input holds lines for the stage, and "@ms" lets
// time pass until then; "!0" presses the stop button and "!1" frees it. What the stage says goes to standard output.
#pragma once
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#define INPUT_PULLUP 2
#define LOW 0
#define constrain(x, low, high) ((x) < (low) ? (low) : ((x) > (high) ? (high) : (x)))

static unsigned long now_ms = 0;
static int button = 1;
static std::string waiting;

static unsigned long millis() { return now_ms; }
static void pinMode(int, int) {}
static int digitalRead(int) { return button; }
static int analogRead(int) { return 0; }

struct Servo {
  void attach(int) {}
  void writeMicroseconds(int) {}
};

struct Port {
  void begin(long) {}
  int available() { return (int)waiting.size(); }
  int read() {
    char c = waiting[0];
    waiting.erase(0, 1);
    return c;
  }
  void print(const char *text) { fputs(text, stdout); }
};
static Port Serial;
