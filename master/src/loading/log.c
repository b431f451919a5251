/* The log callback that units are given. It is C because stable Rust cannot define variadic functions: it formats the
 * message and hands plain text to Rust. Never printf-formats a message twice, never writes beyond its buffer. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

extern void terramech_log_text(void *environment, int status, const char *category, const char *text);

enum { SHORT = 1024, LONGEST = 1 << 20 };

void terramech_logger(void *environment, const char *instance_name, int status, const char *category, const char *message, ...)
{
    char stack[SHORT];
    va_list arguments;
    int length;

    (void)instance_name; /* the environment knows whom it belongs to */
    if (message == NULL)
        message = "(no text)";
    va_start(arguments, message);
    length = vsnprintf(stack, sizeof stack, message, arguments);
    va_end(arguments);
    if (length < 0) {
        /* A format that cannot be expanded: the raw text says more than nothing. */
        terramech_log_text(environment, status, category, message);
    } else if (length < SHORT) {
        terramech_log_text(environment, status, category, stack);
    } else {
        size_t size = length < LONGEST ? (size_t)length + 1 : LONGEST;
        char *heap = malloc(size);
        if (heap == NULL) {
            terramech_log_text(environment, status, category, stack);
            return;
        }
        va_start(arguments, message);
        vsnprintf(heap, size, message, arguments);
        va_end(arguments);
        terramech_log_text(environment, status, category, heap);
        free(heap);
    }
}
