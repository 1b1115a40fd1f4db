#include <iostream>

#include "Servo.h"
#include "tilt_stage.ino"

int main() {
  setup();
  for (std::string line; std::getline(std::cin, line);) {
    if (line[0] == '!') {
      button = atoi(line.c_str() + 1);
    } else if (line[0] == '@') {
      for (unsigned long end = strtoul(line.c_str() + 1, NULL, 10); now_ms < end;) {
        now_ms++;
        loop();
      }
    } else {
      waiting += line + "\n";
      loop();
    }
  }
}
