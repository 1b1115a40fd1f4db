// A servo tilt stage of one or two axes: the other end of station/arm/drivers/servo.py (BSD-3-Clause, as the rest).
//
// ../README.md has the wiring and the lines. What you set stands first. The stage moves only after `A`, refuses what is
// beyond its limits or a jump, holds when it has heard no set-point for WATCHDOG_MS, and levels slowly after that.
// Angles are integers in millionths of a degree. Arduino's own library Servo is all that it needs.

#include <Servo.h>

// ---- what you set ---------------------------------------------------------------------------------------------------

const int AXES = 2;                                 // 1: the model tilt_stage_1; 2: tilt_stage_2
const int SERVO_PIN[2] = {9, 10};
const long LEVEL_US[2] = {1500, 1500};              // the pulse that holds the plate level
const long US_PER_90[2] = {900, 900};               // pulse for 90 degrees; negative where a servo turns the other way
const int SENSOR_PIN[2] = {-1, -1};                 // analogue input of a position sensor; -1: there is none
const long SENSOR_LEVEL[2] = {512, 512};            // what it reads when the plate is level
const long SENSOR_PER_90[2] = {300, 300};           // and how much more after 90 degrees
const int STOP_PIN = 4;                             // a button to ground stops the stage; unconnected, it is free
const long DEGREE = 1000000L;
const long LIMIT = 68 * DEGREE;                     // each axis to either side
const long FASTEST = 60 * DEGREE;                   // a second; the servo itself should manage it under load
const long JUMP = 5 * DEGREE;                       // a set-point this far from the stage is refused
const long LEVELLING = 3 * DEGREE;                  // a second
const unsigned long WATCHDOG_MS = 500;              // without a set-point for so long it holds
const unsigned long LEVEL_AFTER_MS = 5000;          // and so much later it levels
const unsigned long PERIOD_MS = 10;                 // it moves and reports; a servo gets the newest pulse every 20 ms

// ---- what it is -----------------------------------------------------------------------------------------------------

Servo servos[2];
char state = 'I';                                   // Idle, Following, Held, Levelling
bool placed = false;                                // it knows how it stands
bool driven = false;                                // its servos get pulses
long number = 0;                                    // of the last set-point that it took
long life = 0;                                      // the driver's name for this life of the board; 0: it has none
long at[2], goal[2], speed_[2];
unsigned long heard = 0, stepped = 0;

long rounded(long n, long d) {
  if (d < 0) { n = -n; d = -d; }
  return n < 0 ? -((-n + d / 2) / d) : (n + d / 2) / d;
}

long pulse(int axis, long angle) { return LEVEL_US[axis] + rounded(angle / 1000 * US_PER_90[axis], 90000L); }

// Where an axis is: as its sensor says, or else the angle of the pulse that its servo gets.
long place(int axis) {
  if (SENSOR_PIN[axis] >= 0) {
    return 1000 * rounded((analogRead(SENSOR_PIN[axis]) - SENSOR_LEVEL[axis]) * 90000L, SENSOR_PER_90[axis]);
  }
  return 1000 * rounded((pulse(axis, at[axis]) - LEVEL_US[axis]) * 90000L, US_PER_90[axis]);
}

// ---- lines ----------------------------------------------------------------------------------------------------------

unsigned int crc(const char *text, int count) {  // CRC-16/XMODEM
  unsigned int value = 0;
  for (int i = 0; i < count; i++) {
    value ^= (unsigned int)(unsigned char)text[i] << 8;
    for (int bit = 0; bit < 8; bit++) value = 0xFFFF & (value & 0x8000 ? value << 1 ^ 0x1021 : value << 1);
  }
  return value;
}

void say(char *body) {
  char tail[8];
  snprintf(tail, sizeof tail, "*%04X\n", crc(body, strlen(body)));
  Serial.print(body);
  Serial.print(tail);
}

void name(char *body, int count, int room) {
  if (life) snprintf(body + count, room - count, " %ld", life);
}

void report() {
  char body[80];
  int count = snprintf(body, sizeof body, "P %c %ld", state, number);
  for (int i = 0; i < AXES; i++) {
    count += snprintf(body + count, sizeof body - count, " %ld %ld", place(i), speed_[i]);
  }
  name(body, count, sizeof body);
  say(body);
}

void introduce() {
  char body[80];
  int count = snprintf(body, sizeof body, "I 1 %d %d", AXES, placed ? 1 : 0);
  for (int i = 0; i < AXES; i++) count += snprintf(body + count, sizeof body - count, " %ld %ld", -LIMIT, LIMIT);
  name(body, count, sizeof body);
  say(body);
}

// ---- what it is told ------------------------------------------------------------------------------------------------

void stop() {
  for (int i = 0; i < AXES; i++) goal[i] = at[i];
  state = 'I';
}

void arm(long wanted) {
  if (wanted != life) return;                       // it was meant for a life before, whose plate stood elsewhere
  if (state == 'F' || digitalRead(STOP_PIN) == LOW) return;
  for (int i = 0; i < AXES; i++) {
    if (SENSOR_PIN[i] >= 0 && !driven) at[i] = place(i);
    goal[i] = at[i];
    servos[i].writeMicroseconds(pulse(i, at[i]));
    if (!driven) servos[i].attach(SERVO_PIN[i]);
    servos[i].writeMicroseconds(pulse(i, at[i]));
  }
  driven = placed = true;
  state = 'F';
  heard = millis();
}

void follow(char *words) {
  long wanted[2];
  long n = strtol(words, &words, 10);
  if (state != 'F') return;
  for (int i = 0; i < AXES; i++) {
    char *from = words;
    wanted[i] = strtol(from, &words, 10);
    if (words == from) return;
    char limit[] = "E limit", jump[] = "E jump";
    if (wanted[i] > LIMIT || wanted[i] < -LIMIT) return say(limit);
    if (labs(wanted[i] - at[i]) > JUMP) return say(jump);
  }
  for (int i = 0; i < AXES; i++) goal[i] = wanted[i];
  number = n;
  heard = millis();
}

void obey(char *line, int count) {
  int star = count - 5;
  if (star < 1 || line[star] != '*' || strtoul(line + star + 1, NULL, 16) != crc(line, star)) return;
  line[star] = 0;
  if (line[0] == '?') {
    life = strtol(line + 1, NULL, 10);
    introduce();
  }
  if (line[0] == 'A') arm(strtol(line + 1, NULL, 10));
  if (line[0] == 'S') stop();
  if (line[0] == 'T') follow(line + 1);
}

void listen() {
  static char line[80];
  static int count = 0;
  while (Serial.available() > 0) {
    char c = Serial.read();
    if (c == '\n') {
      line[count] = 0;
      if (count < (int)sizeof line - 1) obey(line, count);  // a longer one is none
      count = 0;
    } else if (count < (int)sizeof line - 1) {
      line[count++] = c;
    }
  }
}

// ---- what it does ---------------------------------------------------------------------------------------------------

void mind() {
  unsigned long silent = millis() - heard;
  if (digitalRead(STOP_PIN) == LOW) stop();
  if (state == 'F' && silent > WATCHDOG_MS) {
    stop();
    state = 'H';
  }
  if (state == 'H' && silent > WATCHDOG_MS + LEVEL_AFTER_MS) state = 'L';
}

void move() {
  bool level = true;
  for (int i = 0; i < AXES; i++) {
    long furthest = (state == 'L' ? LEVELLING : FASTEST) / (1000 / (long)PERIOD_MS);
    long way = constrain((state == 'L' ? 0 : goal[i]) - at[i], -furthest, furthest);
    at[i] += way;
    speed_[i] = way * (1000 / (long)PERIOD_MS);
    level = level && at[i] == 0;
    if (driven) servos[i].writeMicroseconds(pulse(i, at[i]));
  }
  if (state == 'L' && level) stop();
}

void setup() {
  Serial.begin(115200);
  pinMode(STOP_PIN, INPUT_PULLUP);
  placed = true;
  for (int i = 0; i < AXES; i++) {
    if (SENSOR_PIN[i] >= 0) at[i] = goal[i] = place(i);
    placed = placed && SENSOR_PIN[i] >= 0;
  }
  stepped = millis();
}

void loop() {
  listen();
  if (millis() - stepped < PERIOD_MS) return;
  stepped += PERIOD_MS;
  mind();
  move();
  report();
}
