/* Calls to the system that fail on request, in a program and all that it starts.
 *
 * HWID_FAULT_LOCKS=ERRNO      every flock() fails with it, as on a file system without locks
 * HWID_FAULT_CLOCK=SECONDS    the clock of the day jumps by so much after a hundred looks
 * HWID_FAULT_FOLDER=DIR       what is below it may fail:
 * HWID_FAULT_KIND=write|read  calls that change something there, or reads of files there
 * HWID_FAULT_AT=N             the N-th such call of a process fails, and all later ones
 * HWID_FAULT_ERRNO=ERRNO      with it
 * HWID_FAULT_ONCE=1           only that one fails
 * HWID_FAULT_COUNT=FILE       the number of such calls is appended to it at the end
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <time.h>
#include <unistd.h>

static long calls;

#define REAL(name) __typeof__(&name) real = (__typeof__(&name))dlsym(RTLD_NEXT, #name)

static long number(const char *name) {
  const char *text = getenv(name);
  return text ? atol(text) : 0;
}

static int is_below(const char *path) {
  const char *folder = getenv("HWID_FAULT_FOLDER");
  return folder && path && !strncmp(path, folder, strlen(folder));
}

static int is_file_below(int file) {
  char link[64], path[PATH_MAX];
  ssize_t length;
  if (!getenv("HWID_FAULT_FOLDER")) return 0;
  snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  length = readlink(link, path, sizeof path - 1);
  if (length <= 0) return 0;
  path[length] = 0;
  return is_below(path);
}

static int fails(const char *kind) {
  const char *wanted = getenv("HWID_FAULT_KIND");
  long at = number("HWID_FAULT_AT");
  if (!wanted || strcmp(wanted, kind)) return 0;
  calls++;
  if (!at || calls < at || (calls > at && getenv("HWID_FAULT_ONCE"))) return 0;
  errno = (int)number("HWID_FAULT_ERRNO");
  return 1;
}

__attribute__((destructor)) static void count(void) {
  const char *path = getenv("HWID_FAULT_COUNT");
  FILE *file = path ? fopen(path, "a") : NULL;
  if (!file) return;
  fprintf(file, "%ld\n", calls);
  fclose(file);
}

int flock(int file, int operation) {
  REAL(flock);
  if (!getenv("HWID_FAULT_LOCKS")) return real(file, operation);
  errno = (int)number("HWID_FAULT_LOCKS");
  return -1;
}

int clock_gettime(clockid_t clock, struct timespec *found) {
  static long looks;
  REAL(clock_gettime);
  int answer = real(clock, found);
  if (clock == CLOCK_REALTIME && getenv("HWID_FAULT_CLOCK") && ++looks > 100)
    found->tv_sec += number("HWID_FAULT_CLOCK");
  return answer;
}

static int fails_at_open(const char *path, int flags) {
  return flags & (O_WRONLY | O_RDWR | O_CREAT | O_TRUNC) && is_below(path) &&
         fails("write");
}

#define OPEN(name)                                   \
  int name(const char *path, int flags, ...) {       \
    REAL(name);                                      \
    va_list rest;                                    \
    mode_t mode;                                     \
    va_start(rest, flags);                           \
    mode = va_arg(rest, mode_t);                     \
    va_end(rest);                                    \
    if (fails_at_open(path, flags)) return -1;       \
    return real(path, flags, mode);                  \
  }
OPEN(open)
OPEN(open64)

ssize_t write(int file, const void *bytes, size_t size) {
  REAL(write);
  if (is_file_below(file) && fails("write")) return -1;
  return real(file, bytes, size);
}

ssize_t read(int file, void *bytes, size_t size) {
  REAL(read);
  if (is_file_below(file) && fails("read")) return -1;
  return real(file, bytes, size);
}

int rename(const char *from, const char *to) {
  REAL(rename);
  if (is_below(to) && fails("write")) return -1;
  return real(from, to);
}

int mkdir(const char *path, mode_t mode) {
  REAL(mkdir);
  if (is_below(path) && fails("write")) return -1;
  return real(path, mode);
}

int unlink(const char *path) {
  REAL(unlink);
  if (is_below(path) && fails("write")) return -1;
  return real(path);
}

int fsync(int file) {
  REAL(fsync);
  if (is_file_below(file) && fails("write")) return -1;
  return real(file);
}
